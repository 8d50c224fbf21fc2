// What the server has told, in the page's own terms.

function toVector(values, at = 0) {
  return new THREE.Vector3(values[at], values[at + 1], values[at + 2]);
}

export class Model {
  constructor() {
    this.site = {title: 'CoMap'};
    this.robots = [];
    this.maps = [];
    this.told = new Set();  // sections that have come
    this.keyframes = [];
    this.byId = new Map();
    this.edges = [];
    this.trails = [];
    this.merges = [];
    this.arrivals = 0;
    this.verdicts = {counts: {}, latest: []};
  }

  take(section) {
    this.told.add(section.section);
    switch (section.section) {
      case 'site': this.site = section; break;
      case 'maps': this.maps = section.maps; break;
      case 'robots': this.takeRobots(section.robots); break;
      case 'keyframes': this.takeKeyframes(section); break;
      case 'edges':
        this.edges = section.edges.map((row) => ({map: row[0], kind: row[1], from: toVector(row, 2), to: toVector(row, 5)}));
        break;
      case 'trails':
        this.trails = section.trails.map(({robot, map, points}) => ({
          robot, map, points: Array.from({length: points.length / 3}, (_, i) => toVector(points, 3 * i))}));
        break;
      case 'merges': this.merges = section.merges; this.arrivals = section.keyframes; break;
      case 'verdicts': this.verdicts = section; break;
    }
  }

  takeRobots(robots) {
    this.robots = robots.map((robot) => ({
      ...robot,
      css: `rgb(${robot.colour.join(',')})`,
      colour: new THREE.Color(...robot.colour.map((value) => value / 255)),
      position: robot.pose ? toVector(robot.pose) : null,
    }));
    for (const keyframe of this.keyframes) this.paint(keyframe);
  }

  takeKeyframes(section) {
    const at = Object.fromEntries(section.columns.map((name, i) => [name, i]));
    this.keyframes = section.keyframes.map((row) => {
      const keyframe = {
        robotNumber: row[at.robot], session: row[at.session], sequence: row[at.sequence], map: section.maps[row[at.map]],
        stamp_s: row[at.stamp_s], arrival: row[at.arrival], accepted: row[at.accepted], refused: row[at.refused],
        position: toVector(row, at.x),
        rotation: new THREE.Quaternion(row[at.qx], row[at.qy], row[at.qz], row[at.qw]),
      };
      this.paint(keyframe);
      return keyframe;
    });
    this.byId = new Map(this.keyframes.map((keyframe) => [keyframe.id, keyframe]));
  }

  paint(keyframe) {
    const robot = this.robots[keyframe.robotNumber];
    keyframe.robot = robot ? robot.name : '?';
    keyframe.colour = robot ? robot.colour : new THREE.Color(0x999999);
    keyframe.css = robot ? robot.css : '#999';
    keyframe.id = `${keyframe.robot}/${keyframe.session}/${keyframe.sequence}`;
  }

  /** Of one map: a line for each robot and session, through its keyframes or as it was heard. */
  waysOf(map) {
    const ways = new Map();
    for (const keyframe of this.keyframes) {
      if (keyframe.map !== map) continue;
      const key = `${keyframe.robot}/${keyframe.session}`;
      if (!ways.has(key)) ways.set(key, {colour: keyframe.colour, keyframes: []});
      ways.get(key).keyframes.push(keyframe);
    }
    const lines = [...ways.values()].map(({colour, keyframes}) => ({
      colour, points: keyframes.sort((a, b) => a.sequence - b.sequence).map((keyframe) => keyframe.position)}));
    for (const trail of this.trails) {
      const robot = this.robots.find((one) => one.name === trail.robot);
      if (trail.map === map && robot) lines.push({colour: robot.colour, points: trail.points});
    }
    return lines;
  }
}
