// Puts the parts of the page together.
import {showKeyframe} from './detail.js';
import {connect} from './feed.js';
import {Model} from './model.js';
import * as panel from './panel.js';
import {Scene} from './scene.js';
import {Timeline} from './timeline.js';

const kTileEdge_m = 0.5;
const $ = (id) => document.getElementById(id);

function notice(text) {
  $('notice').textContent = text;
  $('notice').hidden = !text;
}

function start() {
  const model = new Model(), scene = new Scene($('map'), kTileEdge_m);
  const timeline = new Timeline($('timeline-canvas'), $('timeline-text'));
  let connected = false, drawable = true, mapId = null, chosen = null, mode = 0, fitted = null;
  let due = false, countsDue = false;

  const mapShown = () => model.maps.find((map) => map.id === mapId);

  // The map that was chosen, or the one with most keyframes.
  function chooseMap() {
    if (!mapShown()) {
      const [largest] = [...model.maps].sort((a, b) => b.keyframes - a.keyframes || b.surfels - a.surfels);
      mapId = largest ? largest.id : null;
    }
    const map = mapShown();
    if (!map) return;
    scene.setMap(map);
    const placed = map.surfels > 0 || map.keyframes > 0;
    if (fitted !== map.id && placed) {
      scene.fit(false);
      fitted = map.id;
    }
  }

  // Everything but tiles; cheap enough to be done as a whole, once a frame at most.
  function refresh() {
    due = false;
    chooseMap();
    const keyframes = model.keyframes.filter((keyframe) => keyframe.map === mapId);
    scene.setKeyframes(keyframes);
    scene.setWays(model.waysOf(mapId));
    scene.setMatches(model.edges.filter((edge) => edge.map === mapId));
    scene.setLabels(model.robots.filter((robot) => robot.map === mapId && robot.position)
        .map((robot) => ({text: robot.name, colour: robot.css, position: robot.position})));
    model.robots.slice(0, 8).forEach(({colour}, i) =>
      scene.splats.material.uniforms.robots.value[i].set(colour.r, colour.g, colour.b));
    if (chosen) chosen = model.byId.get(chosen.id) || null;
    panel.showSite(model.site, connected);
    panel.showRobots(model.robots, model.site.live);
    panel.showMaps(model.maps, mapId);
    panel.showVerdicts(model.verdicts);
    panel.showLegend(mode, model.robots);
    timeline.show(model, chosen);
    const contribution = document.querySelector('[data-mode="1"]');
    contribution.disabled = !model.site.contributors_known;
    contribution.title = contribution.disabled ? 'Which robot is which is known from a store only' : '';
    counts();
  }

  function counts() {
    countsDue = false;
    const {tiles, surfels} = scene.splats.counts();
    panel.showCounts({tiles, surfels, keyframes: model.arrivals, merges: model.merges.filter((m) => !m.undone).length});
    notice(whatIsMissing(tiles));
  }

  // Why the map is not there, or not all of it. Of a running site tiles come all the time: the first ones alone count.
  function whatIsMissing(tiles) {
    if (!drawable) return 'The browser has no graphics memory for the map now. It comes back by itself, or with a reload.';
    if (!connected) return '';
    if (!model.told.has('maps')) return 'Loading';
    if (model.maps.length === 0)
      return model.site.live ? 'No map yet. It appears here as soon as the core has one.' :
                               'No map in this store yet. It appears here as soon as a core has made one.';
    const map = mapShown();
    if (!map || (model.site.live && tiles > 0)) return '';
    if (tiles < map.tiles) return `Loading ${tiles.toLocaleString('en')} of ${map.tiles.toLocaleString('en')} tiles`;
    return model.site.live && tiles === 0 ? 'No surfels yet: the core is asked for its tiles.' : '';
  }

  function soon() {
    if (!due) requestAnimationFrame(refresh);
    due = true;
  }

  function choose(keyframe) {
    chosen = keyframe;
    scene.choose(keyframe);
    timeline.show(model, chosen);
    scene.setInsets({right: keyframe && window.innerWidth > 1100 ? 412 : 0});
    if (!keyframe) {
      $('detail').hidden = true;
      $('detail').dataset.keyframe = '';
      return;
    }
    if (keyframe.map !== mapId) {
      mapId = keyframe.map;
      soon();
    }
    showKeyframe(keyframe, model.site.from_store, (verdicts) => {
      const partners = verdicts
          .map(({query, candidate, accepted}) => ({other: model.byId.get(query === keyframe.id ? candidate : query), accepted}))
          .filter(({other}) => other && other.map === keyframe.map)
          .map(({other, accepted}) => ({position: other.position, accepted}));
      scene.choose(keyframe, partners);
    }, (id) => model.byId.has(id) && choose(model.byId.get(id)));
  }

  scene.onContext = (there) => {
    drawable = there;
    counts();
  };
  scene.onPick = (keyframe) => keyframe && choose(keyframe);
  timeline.onPick = choose;
  scene.onDrawn = () => {
    panel.showScale(scene.pixelsPerMetre());
    $('speed').textContent = `${(scene.splats.drawn / 1e3).toFixed(0)} k surfels drawn` +
        (scene.frame_ms ? `, ${(1000 / scene.frame_ms).toFixed(0)} frames/s in motion` : '') +
        (scene.coarse ? ', coarse while moving' : '');
  };
  panel.watchControls({
    mode: (value) => {
      mode = value;
      scene.splats.material.uniforms.mode.value = value;
      panel.showLegend(mode, model.robots);
      scene.dirty = true;
    },
    layer: (name, on) => {
      if (name === 'surfels') scene.splats.group.visible = on;
      else if (name === 'behind') scene.splats.material.uniforms.bothSides.value = on ? 1 : 0;
      else scene.layers[name].visible = on;
      scene.dirty = true;
    },
    size: (value) => {
      scene.splats.material.uniforms.size.value = value;
      scene.dirty = true;
    },
    map: (id) => {
      mapId = id;
      choose(null);
      soon();
    },
    fit: (above) => scene.fit(above),
    insets: (insets) => scene.setInsets(insets),
    closed: () => choose(null),
  });

  const heard = {tiles: 0, bytes: 0, sections: 0};
  connect({
    connected: () => {
      connected = true;
      scene.splats.clear();  // the server sends everything to a new connection
      soon();
    },
    lost: () => {
      connected = false;
      soon();
    },
    section: (section) => {
      ++heard.sections;
      model.take(section);
      soon();
    },
    tile: (tile, bytes) => {
      ++heard.tiles;
      heard.bytes += bytes;
      scene.splats.put(tile);
      scene.dirty = true;
      if (!countsDue) requestAnimationFrame(counts);
      countsDue = true;
    },
  });
  window.comap = {model, scene, heard, choose, counts, chosen: () => chosen};  // for the console and for tests
}

try {
  start();
} catch (error) {
  notice(`The map cannot be shown: ${error.message}`);
  console.error(error);
}
