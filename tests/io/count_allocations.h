// Counts what a thread allocates while it is asked to. Linked into the tests that need it.
#pragma once

namespace shiftrig::io {

class CountAllocations {
  public:
    CountAllocations();
    ~CountAllocations();
    int count() const;  // on this thread, since construction
};

}  // namespace shiftrig::io
