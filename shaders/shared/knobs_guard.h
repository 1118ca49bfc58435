// Written by `ballot shaders --headers` from engine/answer/; a test compares.
// Every define that a traversal kernel reads must be given (engine/answer/variant.cpp).
#ifndef BALLOT_FETCH
#error BALLOT_FETCH is not defined
#endif
#ifndef BALLOT_LAYOUT
#error BALLOT_LAYOUT is not defined
#endif
#ifndef BALLOT_VOTE
#error BALLOT_VOTE is not defined
#endif
#ifndef BALLOT_PACKET_STACK
#error BALLOT_PACKET_STACK is not defined
#endif
#ifndef BALLOT_COOPERATIVE
#error BALLOT_COOPERATIVE is not defined
#endif
#ifndef BALLOT_RAYS
#error BALLOT_RAYS is not defined
#endif
#ifndef BALLOT_FALLBACK
#error BALLOT_FALLBACK is not defined
#endif
#ifndef BALLOT_JUMP
#error BALLOT_JUMP is not defined
#endif
#ifndef BALLOT_REDUCE
#error BALLOT_REDUCE is not defined
#endif
#ifndef BALLOT_STACK
#error BALLOT_STACK is not defined
#endif
#ifndef BALLOT_PUSH
#error BALLOT_PUSH is not defined
#endif
#ifndef BALLOT_PRODUCTS
#error BALLOT_PRODUCTS is not defined
#endif
#ifndef BALLOT_MINMAX
#error BALLOT_MINMAX is not defined
#endif
#ifndef BALLOT_UNPACK
#error BALLOT_UNPACK is not defined
#endif
#ifndef BALLOT_LEAF_BOX
#error BALLOT_LEAF_BOX is not defined
#endif
#ifndef BALLOT_LEAF_RUN
#error BALLOT_LEAF_RUN is not defined
#endif
#ifndef BALLOT_SORTED
#error BALLOT_SORTED is not defined
#endif
#ifndef BALLOT_LAUNCH
#error BALLOT_LAUNCH is not defined
#endif
#ifndef BALLOT_CLAIM
#error BALLOT_CLAIM is not defined
#endif
#ifndef BALLOT_ANY_HIT
#error BALLOT_ANY_HIT is not defined
#endif
#ifndef BALLOT_TRIANGLE
#error BALLOT_TRIANGLE is not defined
#endif
#ifndef BALLOT_BOX
#error BALLOT_BOX is not defined
#endif
#ifndef BALLOT_RAY_TEXELS
#error BALLOT_RAY_TEXELS is not defined
#endif
#ifndef BALLOT_SUBGROUP_BARRIER
#error BALLOT_SUBGROUP_BARRIER is not defined
#endif
#ifndef BALLOT_LEAF_LOOP
#error BALLOT_LEAF_LOOP is not defined
#endif
#ifndef BALLOT_BOX_ORIGIN
#error BALLOT_BOX_ORIGIN is not defined
#endif
#ifndef BALLOT_INSTANCES
#error BALLOT_INSTANCES is not defined
#endif
#ifndef BALLOT_SHAPES
#error BALLOT_SHAPES is not defined
#endif
#ifndef BALLOT_LARGE
#error BALLOT_LARGE is not defined
#endif
#ifndef BALLOT_LOOPS_CUT
#error BALLOT_LOOPS_CUT is not defined
#endif
#ifndef BALLOT_UNIFORM_FLOW
#error BALLOT_UNIFORM_FLOW is not defined
#endif
#ifndef BALLOT_INDIRECT
#error BALLOT_INDIRECT is not defined
#endif
#ifndef BALLOT_CAMERA
#error BALLOT_CAMERA is not defined
#endif
#ifndef BALLOT_DOUBLES
#error BALLOT_DOUBLES is not defined
#endif
#ifndef BALLOT_RAYS_DOUBLE
#error BALLOT_RAYS_DOUBLE is not defined
#endif
#ifndef BALLOT_COUNTERS
#error BALLOT_COUNTERS is not defined
#endif
#ifndef BALLOT_DOUBTFUL
#error BALLOT_DOUBTFUL is not defined
#endif
