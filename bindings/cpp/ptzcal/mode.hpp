// How failures are told: by exceptions, or by ptzcal::result.
#ifndef PTZCAL_MODE_HPP
#define PTZCAL_MODE_HPP

#if !defined(PTZCAL_NO_EXCEPTIONS) && !defined(__cpp_exceptions) && !defined(_CPPUNWIND)
#define PTZCAL_NO_EXCEPTIONS
#endif

// The return types of the two differ, so their functions must not meet in the linker.
#ifdef PTZCAL_NO_EXCEPTIONS
#define PTZCAL_BEGIN namespace ptzcal { inline namespace results {
#else
#define PTZCAL_BEGIN namespace ptzcal { inline namespace exceptions {
#endif
#define PTZCAL_END } }

#endif
