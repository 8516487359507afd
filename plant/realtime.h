// The mark of a function that may run inside the fixed-rate loop: it neither allocates, locks, blocks
// nor throws. With clang 20 and later the compiler checks it (-Wfunction-effects) and RealtimeSanitizer
// watches it run; other compilers read it as plain noexcept.
#pragma once

#if defined(__clang__) && __clang_major__ >= 20
#define SHIFTRIG_REALTIME noexcept [[clang::nonblocking]]
#else
#define SHIFTRIG_REALTIME noexcept
#endif
