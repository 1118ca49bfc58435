// Filters: what a triangle is left out by, with a word of the question for each (shared/query.h). A kernel with
// BALLOT_FILTERS includes this file, behind the walk of instances if it has one.
//
//   begin_filters(question)   reads the words of a question
//   is_left_out(prim)         by its mask, or as it is the one that is excluded
//   group_root(group), shared_root()   where walks of instances begin that meet those of a group and the shared ones
//                             alone
#define HAS_FILTER(filter) ((BALLOT_FILTERS >> (filter) & 1) == 1)

#if HAS_FILTER(FILTER_MASK)
layout(set = 0, binding = BIND_QUESTION_WORDS + FILTER_MASK, scalar) readonly buffer QuestionMasks {
  uint question_masks[];
};
layout(set = 0, binding = BIND_TRIANGLE_MASKS, scalar) readonly buffer TriangleMasks { uint triangle_masks[]; };
uint question_mask;
#endif
#if HAS_FILTER(FILTER_EXCLUDED)
layout(set = 0, binding = BIND_QUESTION_WORDS + FILTER_EXCLUDED, scalar) readonly buffer QuestionExcluded {
  uint question_excluded[];
};
uint excluded_prim;
#endif
#if HAS_FILTER(FILTER_GROUP)
layout(set = 0, binding = BIND_QUESTION_WORDS + FILTER_GROUP, scalar) readonly buffer QuestionGroups {
  uint question_groups[];
};
layout(set = 0, binding = BIND_GROUPS, scalar) readonly buffer Groups { uint group_words[]; };
uint question_group;
#endif

void begin_filters(uint question) {
#if HAS_FILTER(FILTER_MASK)
  question_mask = question_masks[question];
#endif
#if HAS_FILTER(FILTER_EXCLUDED)
  excluded_prim = question_excluded[question];
#endif
#if HAS_FILTER(FILTER_GROUP)
  question_group = question_groups[question];
#endif
}

bool is_left_out(uint prim) {
  bool is_out = false;
#if HAS_FILTER(FILTER_MASK)
  is_out = (triangle_masks[prim] & question_mask) == 0u;
#endif
#if HAS_FILTER(FILTER_EXCLUDED)
  is_out = is_out || prim == excluded_prim;
#endif
  return is_out;
}

#if HAS_FILTER(FILTER_GROUP)
// Returns the root of the tree over the instances of a group; END_OF_TREE if there are none.
uint group_root(uint group) {
  uint count = group_words[0], low = 0u, high = count;
  while (low < high) {
    uint middle = (low + high) >> 1;
    if (group_words[2u + middle] < group)
      low = middle + 1u;
    else
      high = middle;
  }
  return low < count && group_words[2u + low] == group ? group_words[2u + count + low] : END_OF_TREE;
}
uint shared_root() { return group_words[1]; }
#endif
