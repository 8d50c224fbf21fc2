// The WebSocket: sections of JSON and map tiles, again from the start after each reconnection.

const kTile = 1, kHeadBytes = 32;
const upToFour = (bytes) => (bytes + 3) & ~3;

/** A tile message (fleet_tools/view/tile_message.h) as typed arrays that share its memory. */
export function decodeTile(buffer) {
  const head = new DataView(buffer);
  if (buffer.byteLength < kHeadBytes || head.getUint32(0, true) !== kTile) throw new Error('a message of unknown kind');
  const count = head.getUint32(4, true), nameBytes = head.getUint32(20, true);
  const positions = kHeadBytes + upToFour(nameBytes), shapes = positions + upToFour(6 * count);
  const looks = shapes + 4 * count;
  if (buffer.byteLength !== looks + 4 * count) throw new Error('a tile of the wrong length');
  const map = new TextDecoder().decode(new Uint8Array(buffer, kHeadBytes, nameBytes));
  const x = head.getInt32(8, true), y = head.getInt32(12, true), z = head.getInt32(16, true);
  return {
    map, x, y, z, count, key: `${map}:${x}:${y}:${z}`,
    position: new Uint16Array(buffer, positions, 3 * count),
    shape: new Uint8Array(buffer, shapes, 4 * count),
    look: new Uint8Array(buffer, looks, 4 * count),
  };
}

/** Calls `on.section(object)`, `on.tile(tile)`, `on.connected()`, `on.lost()`; keeps trying to connect. */
export function connect(on) {
  const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
  const socket = new WebSocket(`${scheme}://${location.host}/feed`, 'comap-view');
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => on.connected();
  socket.onmessage = (event) => {
    if (typeof event.data === 'string') {
      on.section(JSON.parse(event.data));
    } else {
      on.tile(decodeTile(event.data), event.data.byteLength);
    }
  };
  socket.onclose = () => {
    on.lost();
    setTimeout(() => connect(on), 1500);
  };
}
