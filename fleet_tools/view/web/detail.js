// What is known of one keyframe: its pictures, and each match that was judged, with its numbers.

const kNumbers = [
  ['fern_dissimilarity', 'codes unlike', 3], ['inlier_ratio', 'inliers', 3], ['rms_sigma', 'rms σ', 2],
  ['degeneracy', 'degeneracy', 5], ['photometric_median', 'grey levels', 1], ['seen_through', 'seen through', 3],
  ['unlike', 'patches unlike', 2], ['features', 'features', 2], ['round_trip_m', 'trip mm', 1, 1000],
  ['round_trip_rad', 'trip °', 2, 180 / Math.PI],
];
const kFailing = {contradicted: 'seen_through'};

export function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

function verdictRow(verdict, own, onOther) {
  const row = element('div', 'verdict'), head = element('div', 'head');
  const other = verdict.query === own ? verdict.candidate : verdict.query;
  const button = element('button', 'other', `${verdict.query === own ? 'matched with' : 'asked by'} ${other}`);
  button.onclick = () => onOther(other);
  const outcome = verdict.accepted ? 'accepted' : `refused: ${verdict.reason.replace(/_/g, ' ')}`;
  head.append(button, element('span', `outcome ${verdict.accepted ? 'accepted' : 'refused'}`, outcome));
  const numbers = element('div', 'numbers'), failed = new Set(Object.keys(verdict.failed).map((n) => kFailing[n] || n));
  for (const [name, text, digits, factor = 1] of kNumbers) {
    const number = element('span', failed.has(name) ? 'failed' : '', text);
    number.append(element('b', '', (verdict[name] * factor).toFixed(digits)));
    numbers.append(number);
  }
  row.append(head, numbers);
  return row;
}

function pictures(keyframe) {
  const holder = element('div', 'pictures');
  for (const [kind, caption] of [['colour', 'colour'], ['depth', 'depth: near is bright']]) {
    const figure = element('figure'), image = element('img');
    image.alt = `${caption} of keyframe ${keyframe.id}`;
    image.id = `picture-${kind}`;
    image.src = `/picture/${keyframe.id}/${kind}`;
    figure.append(image, element('figcaption', '', caption));
    holder.append(figure);
  }
  return holder;
}

function facts(keyframe) {
  const list = element('dl', 'facts');
  const p = keyframe.position;
  const rows = [
    ['map', keyframe.map],
    ['time', `${keyframe.stamp_s.toFixed(3)} s`],
    ['arrived as', `number ${keyframe.arrival + 1}`],
    ['position', `${p.x.toFixed(3)}, ${p.y.toFixed(3)}, ${p.z.toFixed(3)} m`],
    ['matches', `${keyframe.accepted} accepted, ${keyframe.refused} refused`],
  ];
  for (const [name, value] of rows) list.append(element('dt', '', name), element('dd', '', value));
  return list;
}

/** Fills the detail panel. `onVerdicts(list)` when they are there, `onOther(id)` when another keyframe is asked for. */
export async function showKeyframe(keyframe, hasPictures, onVerdicts, onOther) {
  const body = document.getElementById('detail-body'), panel = document.getElementById('detail');
  document.getElementById('detail-title').textContent = `Keyframe ${keyframe.id}`;
  body.replaceChildren();
  if (hasPictures) body.append(pictures(keyframe));
  body.append(facts(keyframe));
  panel.hidden = false;
  panel.dataset.keyframe = keyframe.id;
  const answer = await fetch(`/keyframe/${keyframe.id}`);
  if (panel.dataset.keyframe !== keyframe.id) return;  // another was chosen meanwhile
  if (!answer.ok) {
    body.append(element('p', 'quiet', 'The server no longer knows this keyframe.'));
    return;
  }
  const {verdicts, verdicts_in_all: all} = await answer.json();
  if (panel.dataset.keyframe !== keyframe.id) return;
  const order = [...verdicts].sort((a, b) => b.accepted - a.accepted);
  for (const verdict of order) body.append(verdictRow(verdict, keyframe.id, onOther));
  if (all > verdicts.length) body.append(element('p', 'quiet', `The last ${verdicts.length} of ${all} are shown.`));
  if (all === 0) body.append(element('p', 'quiet', 'No place looked enough like it to be judged.'));
  onVerdicts(verdicts);
}
