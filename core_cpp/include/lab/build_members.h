// Part of stage build_hierarchy: what each grid light is made of, to draw shadow points from (Members in
// lab/records.py).
#pragma once

#include "lab/buffer.h"
#include "lab/params.h"
#include "lab/records.h"

namespace lab {

struct MemberData {
    Buffer<std::int64_t> offset;
    Buffer<AliasSlot> slot;
};

// `params`: those that the hierarchy was built with.
MemberData build_members(const HierarchyView& hierarchy, const Params& params);

}  // namespace lab
