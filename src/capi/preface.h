/*
 * ptzcal: turns a pan-tilt-zoom camera with a laser pointer on its head into a surveying instrument,
 * and calibrates the fixed cameras of a surveillance network with it.
 *
 * This header is the manual. It is made from the library's sources (make header): do not edit it.
 * How the ABI is kept across versions is written in COMPATIBILITY.md.
 *
 * CHAPTERS
 *   Conventions, Ownership, Structs that grow, Errors, Threads, Callbacks: below.
 *   Then one chapter for each topic: search for "====".
 *
 * CONVENTIONS
 *   Lengths are metres, angles radians, times seconds, image positions pixels; a name says so when
 *   it holds anything else. Pixel (0, 0) is the CENTRE of the top-left pixel, so an image of width w
 *   reaches from x = -0.5 to w - 0.5.
 *   Camera frame: x right, y down, z forward. A camera's pose is world to camera, x = R X + t; its
 *   centre is -R^T t. Matrices are row-major. Positive pan turns the view right, positive tilt turns
 *   it up, whatever the device's own signs are.
 *   A covariance is in the squared units of its parameters and in their order.
 *   Arrays of points are interleaved: x0 y0 z0 x1 y1 z1 ... An array of no elements may be NULL.
 *   A result that cannot be had is an error with a reason: never NaN, never zeros with success.
 *
 * NAMES
 *   ptzcal_<type>_<verb>. _new makes a handle and _free frees it (NULL is fine); _init sets up a
 *   struct; _set changes a setting; _get fills in a struct; _copy fills a buffer of yours.
 *   Arguments come in this order: the handle, inputs, outputs, the error.
 *
 * OWNERSHIP
 *   Handles (pointers to types without members here) are made and freed by the library only: never
 *   call free() on what it hands out, never copy what a handle points at.
 *   Inputs are borrowed for the call; the library keeps no pointer to them afterwards. Strings that
 *   come out belong to the handle they were taken from. Strings that go in are UTF-8 and end with a
 *   NUL. Handles do not depend on each other after a call: free them in any order.
 *   Outputs are written on success only; on failure they keep what they held, except that a handle
 *   that would have come out is set to NULL, and that `needed` is told when a buffer is too small.
 *   Output of a size that you may not know goes to (buffer, capacity, needed): call once with
 *   (NULL, 0, &needed), which is PTZCAL_STATUS_BUFFER_TOO_SMALL, and again with a buffer. Capacities
 *   count elements, not bytes.
 *   A pointer that says "may be NULL" may be NULL; every other NULL is PTZCAL_STATUS_NULL_POINTER,
 *   and so is never followed. Beyond NULL, alignment and sizes, pointers are trusted.
 *
 * STRUCTS THAT GROW
 *   A struct that begins with struct_size is set up by its _init function, also when the library
 *   writes it:
 *       ptzcal_camera camera;
 *       ptzcal_camera_init(&camera, sizeof camera);
 *   Later versions add members at the end, and struct_size tells both sides how much of the struct
 *   the other knows. A library newer than your header fills in the initial value for what you do not
 *   have, and never touches memory past struct_size. A library older than your header refuses with
 *   PTZCAL_STATUS_UNSUPPORTED what it does not know, unless it is still 0 as _init left it.
 *   Options are handles with one setter for each setting, and grow by new functions; those that are
 *   nothing but numbers (ptzcal_adjust_options) are such a struct.
 *
 * ERRORS
 *   Every function that returns ptzcal_status may return, besides what its comment lists,
 *   PTZCAL_STATUS_NULL_POINTER, PTZCAL_STATUS_INVALID_ARGUMENT, PTZCAL_STATUS_NOT_FINITE,
 *   PTZCAL_STATUS_UNSUPPORTED, PTZCAL_STATUS_BAD_STATE and PTZCAL_STATUS_PANIC. A fault inside the
 *   library (a Rust panic) does not cross this border: it becomes PTZCAL_STATUS_PANIC, and a handle
 *   that was being changed answers PTZCAL_STATUS_BAD_STATE to everything but its _free.
 *
 * THREADS
 *   The library starts no thread unless you ask for one, keeps no global state that you could see,
 *   and works after fork() in the child as before. A handle may move between threads. Each
 *   function's comment says which of these it is:
 *     Threads: free       any number of threads, at any time.
 *     Threads: shared     functions on `const T *`: any number of threads at the same time on one
 *                         handle, but none while a function that is exclusive on it runs.
 *     Threads: exclusive  functions on `T *`: one thread at a time has the handle.
 *   Who breaks this gets PTZCAL_STATUS_BUSY, at once and without harm; nobody waits. Only _free (and
 *   what follows a freed handle) cannot be checked: nobody else may be using the handle.
 *   Different handles never disturb each other.
 *
 * CALLBACKS
 *   Callbacks run on the thread that called the library. They must return: an exception or longjmp
 *   that leaves one ends the program. Since C++17 their types are noexcept, so that the compiler
 *   tells. In C++ catch everything inside, keep it (std::current_exception), stop the work by the
 *   callback's return value, and rethrow after the call.
 */
#ifndef PTZCAL_H
#define PTZCAL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define PTZCAL_NOEXCEPT noexcept
#else
#define PTZCAL_NOEXCEPT
#endif

#if defined(__cplusplus) && __cplusplus >= 201703L
#define PTZCAL_CALLBACK_NOEXCEPT noexcept
#else
#define PTZCAL_CALLBACK_NOEXCEPT
#endif

#ifdef __cplusplus
extern "C" {
#endif
