// The three-dimensional view: surfels, trajectories, keyframes, matches, grid; what is clicked, and when to draw.
import {Splats} from './splats.js';

const kFov = 50, kIdle_ms = 160, kSlow_ms = 45, kFast_ms = 25, kPatience_ms = 1000;
const kWhite = new THREE.Color(0xffffff), kGood = new THREE.Color(0x5cc48d), kBad = new THREE.Color(0xf0726f);

// A camera of this depth, as lines from its centre to the corners and around them.
function frustumLines(pose, depth) {
  const [w, h] = [0.56 * depth, 0.42 * depth];
  const corners = [[-w, -h], [w, -h], [w, h], [-w, h]].map(
      ([x, y]) => new THREE.Vector3(x, y, depth).applyQuaternion(pose.rotation).add(pose.position));
  const lines = [];
  for (let i = 0; i < 4; ++i) lines.push(pose.position, corners[i], corners[i], corners[(i + 1) % 4]);
  return lines;
}

function lineGeometry(points, colours) {
  const geometry = new THREE.BufferGeometry().setFromPoints(points);
  if (colours) {
    const values = new Float32Array(3 * points.length);
    colours.forEach((colour, i) => colour.toArray(values, 3 * i));
    geometry.setAttribute('color', new THREE.BufferAttribute(values, 3));
  }
  return geometry;
}

export class Scene {
  constructor(canvas, edge) {
    this.canvas = canvas;
    const context = canvas.getContext('webgl2', {antialias: true, alpha: false, powerPreference: 'high-performance'});
    if (!context) throw new Error('this browser has no WebGL 2');
    this.renderer = new THREE.WebGLRenderer({canvas, context});
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0x15171a);
    this.camera = new THREE.PerspectiveCamera(kFov, 1, 0.05, 500);
    this.camera.position.set(4, 4, 6);
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.screenSpacePanning = true;
    this.controls.rotateSpeed = 0.7;
    this.controls.zoomSpeed = 1.1;
    this.controls.addEventListener('change', () => this.moved());
    this.world = new THREE.Group();  // turned so that the map's up is up
    this.scene.add(this.world);
    this.splats = new Splats(edge);
    this.world.add(this.splats.group);
    this.layers = {};
    for (const name of ['ways', 'keyframes', 'matches', 'chosen']) {
      this.layers[name] = new THREE.Group();
      this.world.add(this.layers[name]);
    }
    this.layers.grid = new THREE.Group();
    this.scene.add(this.layers.grid);
    this.insets = {left: 0, right: 0, bottom: 0};
    this.keyframes = [];
    this.labels = [];
    this.frame_ms = 0;
    this.adaptive = true;
    this.dirty = true;
    this.lastMove = 0;
    this.onPick = () => {};
    this.onDrawn = () => {};
    this.onContext = () => {};
    this.watchPicks();
    this.watchContext();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    requestAnimationFrame((now) => this.tick(now));
  }

  resize() {
    const {clientWidth, clientHeight} = this.canvas;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / Math.max(1, clientHeight);
    const {left, right, bottom} = this.insets;
    this.camera.setViewOffset(clientWidth, clientHeight, (right - left) / 2, bottom / 2, clientWidth, clientHeight);
    this.dirty = true;
  }

  /** Pixels of a metre at a distance of one metre. */
  pixels() {
    return this.renderer.domElement.height / (2 * Math.tan(kFov * Math.PI / 360));
  }

  moved() {
    this.lastMove = performance.now();
    this.dirty = true;
  }

  // Browsers take the context away where the graphics card is reset or short of memory, and give another one later.
  watchContext() {
    const told = (there) => {
      this.fence = null;
      this.dirty = true;
      this.onContext(there);
    };
    this.canvas.addEventListener('webglcontextlost', () => told(false));
    this.canvas.addEventListener('webglcontextrestored', () => told(true));
  }

  // Draws if anything has changed: coarser while the view moves if full density is too slow, then once in full. No
  // frame is begun before the graphics card is done with the last one, unless it does not tell for a second.
  tick(now) {
    requestAnimationFrame((next) => this.tick(next));
    const gl = this.renderer.getContext();
    if (gl.isContextLost()) return;
    if (this.fence) {
      const done = gl.getSyncParameter(this.fence, gl.SYNC_STATUS) === gl.SIGNALED;
      if (!done && performance.now() - this.begun < kPatience_ms) return;
      gl.deleteSync(this.fence);
      this.fence = null;
      if (this.drewMoving) this.noteFrame(performance.now() - this.begun);
    }
    const moving = now - this.lastMove < kIdle_ms;
    const full = !this.adaptive || !moving;
    if (!this.dirty && !(full && this.coarse)) return;
    this.splats.detail = full ? 1 : (this.movingDetail || 1);
    this.coarse = this.splats.detail < 1;
    this.drewMoving = moving;
    this.dirty = false;
    this.begun = performance.now();
    this.draw();
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  noteFrame(ms) {
    this.frame_ms = this.frame_ms ? 0.7 * this.frame_ms + 0.3 * ms : ms;
    let detail = this.movingDetail || 1;
    if (ms > kSlow_ms) detail *= Math.max(0.5, kSlow_ms / ms);
    if (ms < kFast_ms) detail *= 1.08;
    this.movingDetail = Math.min(1, Math.max(0.05, detail));
  }

  draw() {
    this.scene.updateMatrixWorld();
    this.camera.updateMatrixWorld();
    this.splats.prepare(this.camera, this.pixels());
    this.renderer.render(this.scene, this.camera);
    this.placeLabels();
    this.onDrawn();
  }

  /** Draws `count` frames, turning, at full density; milliseconds of each, the graphics card's work included. */
  async measure(count) {
    const gl = this.renderer.getContext(), pixel = new Uint8Array(4), times = [];
    this.adaptive = false;
    this.splats.detail = 1;
    for (let i = 0; i < count; ++i) {
      this.world.rotateY(2 * Math.PI / count);
      const start = performance.now();
      this.draw();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);  // waits until all is drawn
      times.push(performance.now() - start);
      await new Promise((done) => setTimeout(done));
    }
    this.adaptive = true;
    return times;
  }

  /** Turns the world so that `map.up` is up, and lays the grid at its floor. */
  setMap(map) {
    this.map = map;
    const up = new THREE.Vector3(...map.up);
    this.world.quaternion.setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
    this.world.updateMatrixWorld(true);
    this.splats.showMap(map.id);
    this.layGrid();
    this.dirty = true;
  }

  centre() {
    return new THREE.Vector3(...this.map.centre).applyQuaternion(this.world.quaternion);
  }

  layGrid() {
    const grid = this.layers.grid;
    for (const old of [...grid.children]) {
      old.geometry.dispose();
      grid.remove(old);
    }
    const half = Math.max(3, Math.ceil(this.map.radius * 1.15)), middle = this.centre();
    const lines = new THREE.GridHelper(2 * half, 2 * half, 0x3c424a, 0x272b30);
    lines.position.set(Math.round(middle.x), this.map.low - 0.01, Math.round(middle.z));
    grid.add(lines);
  }

  /** Pixels at the sides and at the foot that panels cover: the view's middle moves out of their way. */
  setInsets(insets) {
    Object.assign(this.insets, insets);
    this.resize();
  }

  fit(fromAbove) {
    if (!this.map) return;
    const middle = this.centre();
    middle.y = Math.min(Math.max(middle.y, this.map.low), this.map.high);
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const free = Math.min(width - this.insets.left - this.insets.right, height - this.insets.bottom) / Math.max(height, 1);
    const distance = 0.95 * this.map.radius / (Math.tan(kFov * Math.PI / 360) * Math.max(free, 0.2));
    const direction = fromAbove ? new THREE.Vector3(0, 1, 0.001) : new THREE.Vector3(0.62, 0.72, 0.75);
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(direction.normalize(), distance);
    this.camera.near = Math.max(0.02, distance / 400);
    this.camera.far = distance * 20 + 50;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.moved();
  }

  clearLayer(name) {
    for (const old of [...this.layers[name].children]) {
      old.geometry.dispose();
      old.material.dispose();
      this.layers[name].remove(old);
    }
    this.dirty = true;
  }

  addLines(name, points, colours, options = {}) {
    if (points.length === 0) return;
    const material = new THREE.LineBasicMaterial({
      vertexColors: colours ? THREE.VertexColors : THREE.NoColors, transparent: true, opacity: options.opacity || 1,
      depthTest: !options.onTop});
    const lines = new (options.strip ? THREE.Line : THREE.LineSegments)(lineGeometry(points, colours), material);
    lines.renderOrder = options.onTop ? 2 : 1;
    lines.frustumCulled = false;
    this.layers[name].add(lines);
  }

  /** `keyframes`: those of the map shown, with position, rotation, colour. */
  setKeyframes(keyframes) {
    this.keyframes = keyframes;
    this.clearLayer('keyframes');
    const points = [], colours = [];
    for (const keyframe of keyframes) {
      const lines = frustumLines(keyframe, 0.09);
      points.push(...lines);
      for (let i = 0; i < lines.length; ++i) colours.push(keyframe.colour);
    }
    this.addLines('keyframes', points, colours, {opacity: 0.9});
  }

  /** `ways`: {points, colour} each. */
  setWays(ways) {
    this.clearLayer('ways');
    for (const way of ways) this.addLines('ways', way.points, way.points.map(() => way.colour), {strip: true});
  }

  /** `matches`: {from, to, kind} each. */
  setMatches(matches) {
    this.clearLayer('matches');
    const points = [], colours = [];
    const loop = new THREE.Color(0x8f7bd8), between = new THREE.Color(0xe8b04b);
    for (const match of matches) {
      points.push(match.from, match.to);
      const colour = match.kind === 'loop' ? loop : between;
      colours.push(colour, colour);
    }
    this.addLines('matches', points, colours, {opacity: 0.75});
  }

  /** Shows which keyframe is chosen and, if known, `partners`: {position, accepted} each. */
  choose(keyframe, partners = []) {
    this.clearLayer('chosen');
    this.chosen = keyframe;
    if (!keyframe) return;
    const lines = frustumLines(keyframe, 0.2);
    this.addLines('chosen', lines, lines.map(() => kWhite), {onTop: true});
    const points = [], colours = [];
    for (const partner of partners) {
      points.push(keyframe.position, partner.position);
      const colour = partner.accepted ? kGood : kBad;
      colours.push(colour, colour);
    }
    this.addLines('chosen', points, colours, {onTop: true});
  }

  /** `labels`: {text, colour, position} each, in the map's frame. */
  setLabels(labels) {
    const holder = document.getElementById('labels');
    while (holder.children.length > labels.length) holder.lastChild.remove();
    while (holder.children.length < labels.length) holder.append(document.createElement('div'));
    this.labels = labels.map((label, i) => {
      const element = holder.children[i];
      element.className = 'label';
      element.textContent = label.text;
      element.style.background = label.colour;
      return {element, position: label.position};
    });
    this.dirty = true;
  }

  /** Where a point of the map is in the canvas, CSS pixels; null if behind the viewer. */
  project(position) {
    const at = position.clone().applyMatrix4(this.world.matrixWorld).project(this.camera);
    if (at.z > 1) return null;
    return {x: (at.x + 1) / 2 * this.canvas.clientWidth, y: (1 - at.y) / 2 * this.canvas.clientHeight};
  }

  placeLabels() {
    for (const {element, position} of this.labels) {
      const at = this.project(position);
      element.style.visibility = at ? 'visible' : 'hidden';
      if (at) element.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px) translate(-50%, -160%)`;
    }
  }

  watchPicks() {
    let down = null;  // a press that may become a pick: not one finger of several
    const held = new Set();
    this.canvas.addEventListener('pointerdown', (event) => {
      held.add(event.pointerId);
      down = held.size === 1 ? {x: event.clientX, y: event.clientY, id: event.pointerId} : null;
    });
    this.canvas.addEventListener('pointerup', (event) => {
      held.delete(event.pointerId);
      if (!down || down.id !== event.pointerId) return;
      const finger = event.pointerType === 'touch';
      if (Math.hypot(event.clientX - down.x, event.clientY - down.y) < (finger ? 12 : 6)) {
        this.onPick(this.nearest(event.clientX, event.clientY, finger ? 30 : 16));
      }
      down = null;
    });
    this.canvas.addEventListener('pointercancel', (event) => {
      held.delete(event.pointerId);
      down = null;
    });
  }

  /** The keyframe nearest to this point of the screen, within `reach` pixels; the one in front if several are. */
  nearest(x, y, reach) {
    if (!this.layers.keyframes.visible) return null;
    let best = null, bestScore = Infinity;
    const eye = this.world.worldToLocal(this.camera.position.clone());
    for (const keyframe of this.keyframes) {
      const at = this.project(keyframe.position);
      if (!at) continue;
      const apart = Math.hypot(at.x - x, at.y - y);
      const score = apart + 2 * eye.distanceTo(keyframe.position);
      if (apart <= reach && score < bestScore) [best, bestScore] = [keyframe, score];
    }
    return best;
  }

  /** CSS pixels of a metre at the point that the view turns about. */
  pixelsPerMetre() {
    const distance = this.camera.position.distanceTo(this.controls.target);
    return this.canvas.clientHeight / (2 * Math.tan(kFov * Math.PI / 360)) / Math.max(distance, 1e-3);
  }
}
