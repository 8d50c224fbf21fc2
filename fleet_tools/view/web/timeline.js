// Keyframes in the order in which they reached the core, a row for each robot; merges where they happened.

export class Timeline {
  constructor(canvas, text) {
    this.canvas = canvas;
    this.text = text;
    this.model = null;
    this.chosen = null;
    this.onPick = () => {};
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener('pointermove', (event) => this.hover(event.offsetX));
    canvas.addEventListener('pointerleave', () => this.tell(null));
    canvas.addEventListener('click', (event) => {
      const hit = this.at(event.offsetX);
      if (hit && hit.keyframe) this.onPick(hit.keyframe);
    });
  }

  show(model, chosen) {
    this.model = model;
    this.chosen = chosen;
    this.draw();
    this.tell(null);
  }

  count() {
    return Math.max(1, this.model.arrivals, ...this.model.merges.map((merge) => merge.keyframes_ingested));
  }

  xOf(arrival) {
    return 4 + (arrival + 0.5) / this.count() * (this.canvas.clientWidth - 8);
  }

  draw() {
    if (!this.model) return;
    const {clientWidth: width, clientHeight: height} = this.canvas, ratio = window.devicePixelRatio || 1;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const context = this.canvas.getContext('2d');
    context.scale(ratio, ratio);
    const rows = Math.max(1, this.model.robots.length), top = 12, row = (height - top - 4) / rows;
    context.fillStyle = '#2a2e33';
    for (let i = 0; i < rows; ++i) context.fillRect(4, top + (i + 0.5) * row - 0.5, width - 8, 1);
    const tick = Math.max(1.2, Math.min(5, (width - 8) / this.count() - 1));
    for (const keyframe of this.model.keyframes) {
      context.fillStyle = keyframe.css;
      const y = top + keyframe.robotNumber * row;
      context.fillRect(this.xOf(keyframe.arrival) - tick / 2, y + 1, tick, Math.max(2, row - 2));
    }
    if (this.chosen) {
      context.strokeStyle = '#fff';
      context.lineWidth = 1.5;
      const y = top + this.chosen.robotNumber * row;
      context.strokeRect(this.xOf(this.chosen.arrival) - tick / 2 - 2, y - 1, tick + 4, Math.max(2, row - 2) + 4);
    }
    for (const merge of this.model.merges) this.drawMerge(context, merge, height);
  }

  drawMerge(context, merge, height) {
    const x = this.xOf(merge.keyframes_ingested - 1);
    context.strokeStyle = context.fillStyle = merge.undone ? '#f0726f' : '#e8eaed';
    context.lineWidth = 1;
    context.setLineDash(merge.undone ? [3, 3] : []);
    context.beginPath();
    context.moveTo(x, 8);
    context.lineTo(x, height);
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x + 5, 5);
    context.lineTo(x, 10);
    context.lineTo(x - 5, 5);
    context.fill();
  }

  at(x) {
    if (!this.model) return null;
    const reach = (list, place) => list.map((one) => ({one, apart: Math.abs(this.xOf(place(one)) - x)}))
        .sort((a, b) => a.apart - b.apart).find(({apart}) => apart < 8);
    const merge = reach(this.model.merges, (one) => one.keyframes_ingested - 1);
    if (merge) return {merge: merge.one, keyframe: null};
    const keyframe = reach(this.model.keyframes, (one) => one.arrival);
    return keyframe ? {merge: null, keyframe: keyframe.one} : null;
  }

  hover(x) {
    this.tell(this.at(x));
  }

  tell(hit) {
    if (!this.model) return;
    if (hit && hit.merge) {
      const {number, kept, absorbed, robots, voters, undone} = hit.merge;
      const fate = undone ? `undone: ${undone}` : 'holds';
      this.text.textContent =
          `Merge ${number}: ${absorbed} into ${kept}; robots ${robots.join(', ')}; ${voters.length} closures agreed; ${fate}`;
    } else if (hit && hit.keyframe) {
      const {id, accepted, refused} = hit.keyframe;
      this.text.textContent = `Keyframe ${id}: ${accepted} matches accepted, ${refused} refused`;
    } else {
      const {arrivals, merges} = this.model;
      const undone = merges.filter((merge) => merge.undone).length;
      this.text.textContent = `${arrivals} keyframes in order of arrival; ${merges.length} ` +
          `${merges.length === 1 ? 'merge' : 'merges'} of maps${undone ? `, ${undone} of them undone` : ''}`;
    }
  }
}
