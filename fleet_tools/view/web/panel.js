// The panel at the left: what there is, and what of it is drawn.
import {element} from './detail.js';

const $ = (id) => document.getElementById(id);
const kStates = {ok: 'tracking', poor: 'tracking poorly', lost: 'lost', finished: 'finished', silent: 'silent', stored: ''};

const counted = (count, noun) => `${count} ${noun}${count === 1 ? '' : 's'}`;

export function showSite(site, connected) {
  $('title').textContent = site.title;
  document.title = `${site.title} - CoMap`;
  const parts = [];
  if (site.live) {
    if (!site.core_heard) {
      const since = site.core_gone_ms && new Date(site.core_gone_ms).toLocaleTimeString();
      parts.push(since ? `core gone since ${since}: shown is what it had` : 'no core is heard');
    } else if (site.core) {
      const {keyframes, maps, queue, device} = site.core;
      parts.push(`live: ${counted(keyframes, 'keyframe')}, ${counted(maps, 'map')}, ${queue} waiting, ${device}`);
    } else {
      parts.push('live');
    }
  } else if (site.from_store) {
    parts.push(site.complete ? 'store, complete' : 'store, still being written');
  }
  if (!connected) parts.unshift('the server does not answer');
  $('subtitle').textContent = parts.join('; ');
  $('subtitle').className = !connected || (site.live && !site.core_heard) ? 'bad' : '';
}

export function showRobots(robots, live) {
  $('robots').replaceChildren(...robots.map((robot) => {
    const row = element('li'), swatch = element('span', 'swatch');
    swatch.style.background = robot.css;
    const counts = [counted(robot.keyframes, 'keyframe')];
    if (live && robot.frames) counts.push(counted(robot.frames, 'frame'), `${robot.outbox} to send`);
    row.append(swatch, element('span', 'name', robot.name), element('span', `state ${robot.state}`, kStates[robot.state]),
        element('span', 'more', counts.join(', ')));
    return row;
  }));
  if (robots.length === 0) $('robots').append(element('li', 'quiet', 'none yet'));
}

export function showMaps(maps, chosen) {
  $('maps-section').hidden = maps.length < 2;
  $('maps').replaceChildren(...maps.map((map) => {
    const option = element('option', '', `${map.robots.join(', ') || 'nobody'}: ${counted(map.keyframes, 'keyframe')} (${map.id})`);
    option.value = map.id;
    option.selected = map.id === chosen;
    return option;
  }));
}

export function showCounts({surfels, tiles, keyframes, merges}) {
  const number = (value) => value.toLocaleString('en');
  $('count-surfels').textContent = number(surfels);
  $('count-tiles').textContent = number(tiles);
  $('count-keyframes').textContent = number(keyframes);
  $('count-merges').textContent = number(merges);
}

export function showLegend(mode, robots) {
  const legend = $('legend');
  legend.replaceChildren();
  if (mode === 1) {
    for (const robot of robots.slice(0, 8)) {
      const entry = element('span'), swatch = element('span', 'swatch');
      swatch.style.background = robot.css;
      entry.append(swatch, `only ${robot.name}`);
      legend.append(entry);
    }
    if (robots.length > 1) legend.append(element('span', '', 'mixed colours: seen by several'));
  }
  if (mode === 2) {
    const ends = element('div', 'ends');
    ends.append(element('span', '', 'weight 1'), element('span', '', '50 and more'));
    legend.append(element('div', 'ramp'), ends);
  }
  for (const [kind, text] of [['between', 'match between robots'], ['loop', 'loop']]) {
    const entry = element('span');
    entry.append(element('span', `stroke ${kind}`), text);
    legend.append(entry);
  }
}

export function showVerdicts({counts}) {
  const rows = Object.entries(counts).sort(([a, n], [b, m]) => (b === 'accepted') - (a === 'accepted') || m - n);
  const most = Math.max(1, ...rows.map(([, count]) => count));
  $('verdicts').replaceChildren();
  for (const [reason, count] of rows) {
    const good = reason === 'accepted' ? 'accepted' : '';
    const bar = element('div', `bar ${good}`);
    bar.style.width = `${100 * count / most}%`;
    $('verdicts').append(element('span', good, good ? 'accepted' : `refused: ${reason.replace(/_/g, ' ')}`),
        element('span', 'number', count.toLocaleString('en')), bar);
  }
  if (rows.length === 0) $('verdicts').append(element('span', 'quiet', 'none judged yet'));
}

/** Lengths of 1, 2, 5 times a power of ten that are 60 to 160 pixels. */
export function showScale(pixelsPerMetre) {
  let length = 10 ** Math.floor(Math.log10(160 / pixelsPerMetre));
  for (const factor of [5, 2]) {
    if (length * factor * pixelsPerMetre <= 160) {
      length *= factor;
      break;
    }
  }
  $('scale-bar').style.width = `${(length * pixelsPerMetre).toFixed(1)}px`;
  $('scale-text').textContent = length >= 1 ? `${length} m` : `${Math.round(length * 100)} cm`;
}

/** Calls `on.mode`, `on.layer`, `on.size`, `on.map`, `on.fit`, `on.insets`, `on.closed` as the controls are used. */
export function watchControls(on) {
  const fold = () => {
    const folded = $('panel').classList.toggle('folded');
    $('fold').setAttribute('aria-expanded', String(!folded));
    on.insets({left: folded ? 0 : 284});
  };
  $('fold').onclick = fold;
  on.insets({left: 284, bottom: 96});
  if (window.innerWidth < 760) fold();
  for (const button of document.querySelectorAll('#colouring button')) {
    button.onclick = () => {
      for (const other of document.querySelectorAll('#colouring button')) other.setAttribute('aria-pressed', String(other === button));
      on.mode(Number(button.dataset.mode));
    };
  }
  for (const box of document.querySelectorAll('[data-layer]')) {
    box.onchange = () => on.layer(box.dataset.layer, box.checked);
  }
  $('size').oninput = () => on.size(Number($('size').value));
  $('maps').onchange = () => on.map($('maps').value);
  $('fit').onclick = () => on.fit(false);
  $('top').onclick = () => on.fit(true);
  $('detail-close').onclick = () => on.closed();
  window.addEventListener('keydown', (event) => {
    if (event.target.closest('input, select')) return;
    if (event.key === 'f') on.fit(false);
    if (event.key === 't') on.fit(true);
    if (event.key === 'Escape') on.closed();
  });
}
