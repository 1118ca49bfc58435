// Masks: a triangle is left out whose mask shares no bit with that of the question. A kernel with BALLOT_MASKS includes
// this file.
layout(set = 0, binding = BIND_RAY_MASKS, scalar) readonly buffer QuestionMasks { uint question_masks[]; };
layout(set = 0, binding = BIND_TRIANGLE_MASKS, scalar) readonly buffer TriangleMasks { uint triangle_masks[]; };
uint question_mask;

void begin_masks(uint question) { question_mask = question_masks[question]; }
bool is_masked(uint prim) { return (triangle_masks[prim] & question_mask) == 0u; }
