// What a kernel only reads it sees as texels, four words wide (samplerBuffer, usamplerBuffer) or one (uimageBuffer,
// imageBuffer); so too the words it changes by atomics. Software devices fetch texels for eight threads at once, and
// storage buffers thread by thread: that is half of a kernel's time. Not worth it for what few threads read, under a
// condition.
#define fetch(texels, i) texelFetch(texels, int(i))
#define fetchWord(words, i) imageLoad(words, int(i)).x
