// As resolve.comp, but shows a surfel's owner where that shows its contributors. One item = one pixel.
#version 450
#extension GL_GOOGLE_include_directive : require
#define SHOWN_WORD(look) (look).z
#include "common/resolving.glsl"
