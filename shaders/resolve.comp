// Last pass of a prediction: what each pixel shows, if that is of this chunk. Reads keys and the surfel streams; writes
// two vec4 per pixel: normal in the camera's frame and depth (0 = nothing), then colour bits, confidence, contributor
// bits, and the key's rank, by which a nearer centre in a later group of chunks replaces it.
// One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#define SHOWN_WORD(look) (look).w
#include "common/resolving.glsl"
