// The mark of a function that may run inside the fixed-rate loop: it neither allocates, locks, blocks
// nor throws. With clang 20 and later the compiler checks it (-Wfunction-effects) and RealtimeSanitizer
// watches it run; other compilers read it as plain noexcept.
#pragma once

#ifndef SHIFTRIG_REALTIME
#if defined(__clang__) && __clang_major__ >= 20
#define SHIFTRIG_REALTIME noexcept [[clang::nonblocking]]
// Around a function whose body the compiler cannot see through (a library without marks, a vector within its
// reserve) although it keeps the promise. Only the compiler's check is silenced, RealtimeSanitizer still watches.
#define SHIFTRIG_TRUSTED_BEGIN \
    _Pragma("clang diagnostic push") _Pragma("clang diagnostic ignored \"-Wfunction-effects\"")
#define SHIFTRIG_TRUSTED_END _Pragma("clang diagnostic pop")
#else
#define SHIFTRIG_REALTIME noexcept
#define SHIFTRIG_TRUSTED_BEGIN
#define SHIFTRIG_TRUSTED_END
#endif
#endif
