// The push constants, as a copy that main() takes first (push = given): software devices fetch what is read within a
// loop or a branch anew for each thread, and what is read before them once. Needs struct Push.
layout(push_constant) uniform Given { Push given; };
Push push;
