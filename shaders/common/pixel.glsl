// The pixel of an index. Needs push.width. Devices divide whole numbers slowly, software devices one by one.
uvec2 pixelOf(uint index) {
  int row = int(float(index) / float(push.width));
  int column = int(index) - row * int(push.width);
  // The quotient of floats is wrong by one at most.
  int off = column < 0 ? -1 : (column >= int(push.width) ? 1 : 0);
  return uvec2(uint(column - off * int(push.width)), uint(row + off));
}
