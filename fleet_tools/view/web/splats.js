// Surfels as round splats: one geometry and one draw call a tile, fewer of its surfels the smaller it is on the screen.

const vertexShader = `
attribute vec4 shape;
attribute vec4 look;
uniform float pixels, size, grow, bothSides;
uniform int mode;
uniform vec3 robots[8];
varying vec3 vColour;
varying vec3 vNormal;

vec3 directionOf(vec2 code) {
  vec2 o = min((code - 127.0) / 127.0, 1.0);
  vec3 n = vec3(o, 1.0 - abs(o.x) - abs(o.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

vec3 confidenceColour(float confidence) {
  float place = clamp(log(max(confidence, 1.0)) / log(50.0), 0.0, 1.0) * 4.0;
  vec3 a = vec3(68, 1, 84), b = vec3(59, 82, 139), c = vec3(33, 145, 140), d = vec3(94, 201, 98), e = vec3(253, 231, 37);
  vec3 colour = mix(a, b, clamp(place, 0.0, 1.0));
  colour = mix(colour, c, clamp(place - 1.0, 0.0, 1.0));
  colour = mix(colour, d, clamp(place - 2.0, 0.0, 1.0));
  return mix(colour, e, clamp(place - 3.0, 0.0, 1.0)) / 255.0;
}

vec3 contributionColour(float bits) {
  vec3 sum = vec3(0.0);
  float count = 0.0;
  for (int i = 0; i < 8; ++i) {
    float bit = mod(bits, 2.0);
    bits = floor(bits / 2.0);
    sum += bit * robots[i];
    count += bit;
  }
  return count > 0.0 ? sum / count : vec3(0.63);
}

void main() {
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  vNormal = normalize(mat3(modelViewMatrix) * directionOf(shape.xy));
  float facing = dot(vNormal, -normalize(at.xyz));
  if (bothSides < 0.5 && facing < 0.02) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    gl_PointSize = 0.0;
    return;
  }
  if (facing < 0.0) vNormal = -vNormal;
  float radius = 0.0005 * exp(shape.z * 0.0295588022);
  gl_PointSize = clamp(2.0 * radius * size * grow * pixels / max(-at.z, 0.02), 1.6, 96.0);
  gl_Position = projectionMatrix * at;
  vec3 colour = look.xyz / 255.0;
  if (mode == 1) colour = contributionColour(look.w);
  if (mode == 2) colour = confidenceColour(shape.w);
  float light = 0.80 + 0.26 * max(0.0, dot(vNormal, normalize(vec3(-0.4, 0.6, 0.7))));
  vColour = colour * (mode == 0 ? 0.45 + 0.55 * light : light);
}`;

// A disc seen at an angle is an ellipse within the point's square.
const fragmentShader = `
varying vec3 vColour;
varying vec3 vNormal;
void main() {
  vec2 p = vec2(gl_PointCoord.x - 0.5, 0.5 - gl_PointCoord.y) * 2.0;
  float rise = dot(p, vNormal.xy) / max(abs(vNormal.z), 0.25);
  if (dot(p, p) + rise * rise > 1.0) discard;
  gl_FragColor = vec4(vColour, 1.0);
}`;

export class Splats {
  /** `edge`: of a tile, metres. */
  constructor(edge) {
    this.edge = edge;
    this.group = new THREE.Group();
    this.tiles = new Map();
    this.surfels = 0;
    this.detail = 1;  // share of the full density; lowered while moving on slow machines
    this.drawn = 0;
    this.map = null;
    this.material = new THREE.ShaderMaterial({
      vertexShader, fragmentShader,
      uniforms: {
        pixels: {value: 1}, size: {value: 1.15}, grow: {value: 1}, bothSides: {value: 0}, mode: {value: 0},
        robots: {value: Array.from({length: 8}, () => new THREE.Vector3(0.6, 0.6, 0.6))},
      },
    });
  }

  put(tile) {
    this.remove(tile.key);
    if (tile.count === 0) return;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(tile.position, 3, true));
    geometry.setAttribute('shape', new THREE.BufferAttribute(tile.shape, 4));
    geometry.setAttribute('look', new THREE.BufferAttribute(tile.look, 4));
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(0.5, 0.5, 0.5), 0.9);
    const points = new THREE.Points(geometry, this.material);
    const step = this.edge / 65536;  // positions mean the middle of their step
    points.scale.setScalar(step * 65535);
    points.position.set(tile.x * this.edge + step / 2, tile.y * this.edge + step / 2, tile.z * this.edge + step / 2);
    points.updateMatrix();
    points.matrixAutoUpdate = false;
    points.visible = tile.map === this.map;
    points.userData = {map: tile.map, count: tile.count, grow: 1};
    points.onBeforeRender = () => {
      this.material.uniforms.grow.value = points.userData.grow;
      this.material.uniformsNeedUpdate = true;
      this.drawn += geometry.drawRange.count;
    };
    this.tiles.set(tile.key, points);
    this.group.add(points);
    this.surfels += tile.count;
  }

  remove(key) {
    const points = this.tiles.get(key);
    if (!points) return;
    this.surfels -= points.userData.count;
    points.geometry.dispose();
    this.group.remove(points);
    this.tiles.delete(key);
  }

  clear() {
    for (const key of [...this.tiles.keys()]) this.remove(key);
  }

  showMap(map) {
    this.map = map;
    for (const points of this.tiles.values()) points.visible = points.userData.map === map;
  }

  /** Of the map shown: how many tiles and surfels are here. */
  counts() {
    let tiles = 0, surfels = 0;
    for (const points of this.tiles.values()) {
      if (points.userData.map !== this.map) continue;
      ++tiles;
      surfels += points.userData.count;
    }
    return {tiles, surfels};
  }

  /** Before each frame. `pixels`: of a metre at one metre's distance, on the screen. */
  prepare(camera, pixels) {
    this.drawn = 0;
    this.material.uniforms.pixels.value = pixels;
    const eye = new THREE.Vector3(), middle = new THREE.Vector3();
    camera.getWorldPosition(eye);
    for (const points of this.tiles.values()) {
      if (!points.visible) continue;
      middle.set(0.5, 0.5, 0.5).applyMatrix4(points.matrixWorld);
      const distance = Math.max(eye.distanceTo(middle) - this.edge, 0.2);
      const side = this.edge * pixels / distance;  // of the tile, in pixels
      const {count} = points.userData;
      const wanted = Math.max(Math.min(count, 3 * side * side) * this.detail, Math.min(count, 60));
      const drawn = Math.min(count, Math.ceil(wanted));
      points.geometry.setDrawRange(0, drawn);
      points.userData.grow = Math.min(2.6, Math.sqrt(count / drawn));
    }
  }
}
