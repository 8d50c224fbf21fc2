// Which pixels start a new surfel. Needs common/frame.glsl, common/measurement.glsl and the buffers named here.

// Candidate `i` of the lattice of even pixels, in raster order.
uint candidatePixel(uint i) {
  uint columns = (push.width + 1u) / 2u;
  return i / columns * 2u * push.width + i % columns * 2u;
}

bool startsSurfel(uint i) {
  if (i >= push.candidates) return false;
  uint index = candidatePixel(i);
  float z = fetch(measurements, index).w;
  if (z <= 0.0 || fetchWord(covered, index) != 0u) return false;
  uint stride = strideOf(z);
  return (index % push.width) % stride == 0u && (index / push.width) % stride == 0u;
}
