// ptzcal for C++17, header only: https://en.cppreference.com/w/cpp/17 is all it needs besides ptzcal.h.
//
//     ptzcal::rig rig = ptzcal::rig::open(options);
//     ptzcal::scan scan = rig.scan_region(region, scan_options, [](const ptzcal_progress &) { ... });
//
// NAMES: ptzcal_<type>_<verb> is ptzcal::<type>::<verb>; `get_` and `copy_` fall away, `_new` is the
// constructor, `_free` and `_close` the destructor. What begins with no type is a function of the
// namespace. ptzcal.h is the manual: units, frames, threads, statuses are as written there.
//
// ERRORS: a failed call throws ptzcal::error. With PTZCAL_NO_EXCEPTIONS defined (or -fno-exceptions)
// it returns a ptzcal::result instead, and so does every function: outcome<T> is T or result<T>. Both
// kinds of translation units may be linked together: they are different inline namespaces. A single
// failure that is expected is a value in either: ptzcal::attempt([&] { return ... }).
//
// OBJECTS own their handle: they move, and do not copy. A moved-from object holds nothing, and every
// call with it is status::null_pointer. Structs (camera, region, ...) are the C ones, set up when made,
// and copy. Arrays go in as views of anything contiguous, with their lengths checked against each
// other, and come out as std::vector or std::array. An input that may be NULL in C may be left out.
//
// CALLBACKS are any callables. An exception in one stops the work, and leaves the call that it runs
// in; see ptzcal/callbacks.hpp.
//
// cv::Mat: ptzcal/opencv.hpp, included where it is wanted.
#ifndef PTZCAL_HPP
#define PTZCAL_HPP

#if !defined(__cplusplus) || (__cplusplus < 201703L && (!defined(_MSVC_LANG) || _MSVC_LANG < 201703L))
#error "ptzcal.hpp needs C++17"
#endif

#include <ptzcal.h>

#include "ptzcal/constants.hpp"
#include "ptzcal/error.hpp"
#include "ptzcal/view.hpp"
#include "ptzcal/handle.hpp"
#include "ptzcal/callbacks.hpp"
#include "ptzcal/api.hpp"
#include "ptzcal/devices.hpp"
#include "ptzcal/image.hpp"

#endif
