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

/* ================================================================================================
 * Versions
 *
 * PTZCAL_ABI_VERSION is what this header was written for; ptzcal_abi_version() is what the loaded
 * library keeps. They are equal whenever the dynamic linker found the library by its soname
 * (libptzcal.so.N, N the ABI number); who loads it with dlopen compares them. New functions and new
 * members do not change the number: it changes when, and only when, a program that was compiled
 * against an older header would break.
 * ============================================================================================= */

/** ABI number of this header; see ptzcal_abi_version. */
#define PTZCAL_ABI_VERSION 1

/**
 * Version of the library, such as "0.1.0" (semantic versioning).
 *
 * @return A static string; never NULL, never freed.
 *
 * Threads: free.
 * Since 0.1.0.
 */
const char *ptzcal_version(void) PTZCAL_NOEXCEPT;

/**
 * ABI number of the loaded library; compare it with PTZCAL_ABI_VERSION after dlopen.
 *
 * @return The number.
 *
 * Threads: free.
 * Since 0.1.0.
 */
uint32_t ptzcal_abi_version(void) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Statuses
 *
 * What every function that can fail returns. 0 is success, everything else is negative and grouped
 * by who can do something about it. The numbers are pinned for ever; new ones may be added, so
 * treat an unknown negative number as a failure.
 * ============================================================================================= */

/** Result of a call. The values never change. */
enum {
  /** Success: every output was written. */
  PTZCAL_STATUS_OK = 0,
  /** Argument: a value, size, format, enum or string is not acceptable; the message names it. */
  PTZCAL_STATUS_INVALID_ARGUMENT = -1,
  /** Argument: a pointer that must not be NULL is NULL; the message names it. */
  PTZCAL_STATUS_NULL_POINTER = -2,
  /** Argument: a number is NaN or infinite; the error's index says which. */
  PTZCAL_STATUS_NOT_FINITE = -3,
  /** Argument: a buffer is smaller than what it must hold; nothing was written to it. */
  PTZCAL_STATUS_BUFFER_TOO_SMALL = -4,
  /** What was asked for is not in this library or this build, or needs a newer one. */
  PTZCAL_STATUS_UNSUPPORTED = -5,
  /** Another thread is inside a call that has the handle for itself. */
  PTZCAL_STATUS_BUSY = -6,
  /** The handle's state does not allow the call; after a PANIC only its _free or _close does. */
  PTZCAL_STATUS_BAD_STATE = -7,
  /** Argument: the address of a device has not the form that its kind demands; the message says where. */
  PTZCAL_STATUS_INVALID_ADDRESS = -8,
  /** Data: too few measurements are usable. */
  PTZCAL_STATUS_TOO_FEW_POINTS = -100,
  /** Data: the geometry cannot determine the result (coplanar, collinear, ...); the hint says what to add. */
  PTZCAL_STATUS_DEGENERATE = -101,
  /** Data: the solver did not converge. */
  PTZCAL_STATUS_NO_CONVERGENCE = -102,
  /** Data: too many measurements contradict each other. */
  PTZCAL_STATUS_NO_CONSENSUS = -103,
  /** Data: the fitted lens would fold back inside the image. */
  PTZCAL_STATUS_LENS_NOT_MONOTONE = -104,
  /** Data: a point lies behind the camera; the error's index says which. */
  PTZCAL_STATUS_BEHIND_CAMERA = -105,
  /** Data: the target cannot be reached by the head. */
  PTZCAL_STATUS_UNREACHABLE = -106,
  /** Data: a point has no image (or a pixel no ray) in the lens model; the error's index says which. */
  PTZCAL_STATUS_OUTSIDE_LENS = -107,
  /** Detection: there is no laser spot that stands out from the noise. */
  PTZCAL_STATUS_NOT_FOUND = -200,
  /** Detection: more than one spot could be the laser's. */
  PTZCAL_STATUS_AMBIGUOUS = -201,
  /** Device: a device reported a failure. */
  PTZCAL_STATUS_DEVICE = -300,
  /** Device: the connection is gone. */
  PTZCAL_STATUS_DEVICE_LOST = -301,
  /** Device: no answer in time. */
  PTZCAL_STATUS_DEVICE_TIMEOUT = -302,
  /** Device: the laser stays off (emergency stop, head moving, ...). */
  PTZCAL_STATUS_LASER_REFUSED = -303,
  /** Device: there is no such device file, line or host, or nobody listens there. */
  PTZCAL_STATUS_DEVICE_NOT_FOUND = -304,
  /** Device: this user may not open it. */
  PTZCAL_STATUS_DEVICE_PERMISSION = -305,
  /** Device: another process holds it. */
  PTZCAL_STATUS_DEVICE_BUSY = -306,
  /** Device: something answers, and it is not what the address says. */
  PTZCAL_STATUS_DEVICE_MISMATCH = -307,
  /** Device: bytes arrive that are no messages: another baud rate, or a bad line. */
  PTZCAL_STATUS_DEVICE_GARBLED = -308,
  /** Device: it understood, and refuses. */
  PTZCAL_STATUS_DEVICE_REFUSED = -309,
  /** Device: it wants another user's name or password. */
  PTZCAL_STATUS_UNAUTHORISED = -310,
  /** File: reading or writing failed. */
  PTZCAL_STATUS_FILE_IO = -400,
  /** File: the content is not what it should be. */
  PTZCAL_STATUS_FILE_FORMAT = -401,
  /** File: written by a version that this library does not read. */
  PTZCAL_STATUS_FILE_VERSION = -402,
  /** File: it belongs to another rig, region or run. */
  PTZCAL_STATUS_FILE_MISMATCH = -403,
  /** File: the disk is full. */
  PTZCAL_STATUS_DISK_FULL = -404,
  /** Stopped by a ptzcal_cancel token or a progress callback. */
  PTZCAL_STATUS_CANCELLED = -500,
  /** A fault of the library; please report the message. */
  PTZCAL_STATUS_INTERNAL = -900,
  /** A fault of the library was caught; handles that were being changed can only be closed. */
  PTZCAL_STATUS_PANIC = -901,
};
typedef int32_t ptzcal_status;

/**
 * Name of a status, such as "PTZCAL_STATUS_NOT_FOUND".
 *
 * @param status A ptzcal_status, or any number.
 * @return A static string; "PTZCAL_STATUS_UNKNOWN" for a number that is no status. Never NULL.
 *
 * Threads: free.
 * Since 0.1.0.
 */
const char *ptzcal_status_name(int32_t status) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Errors
 *
 * A status says what kind of failure it was; an error object says what exactly went wrong, which
 * point, view or sample is at fault, and what to do about it. Functions take `ptzcal_error **error`
 * as their last argument. Pass NULL when the status is enough. Otherwise `*error` is set to NULL on
 * entry (it is not freed: an older error is yours to free first) and, when the call fails, to a new
 * error object, which you free with ptzcal_error_free.
 * ============================================================================================= */

/** Why a call failed. Immutable: any number of threads may read it. */
typedef struct ptzcal_error ptzcal_error;

/**
 * Status of an error: the one that the failed call returned.
 *
 * @param error The error; may be NULL.
 * @return Its status; PTZCAL_STATUS_OK for NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_error_status(const ptzcal_error *error) PTZCAL_NOEXCEPT;

/**
 * What went wrong, one line of English UTF-8, with the offending value in it. For logs and people:
 * the wording may change in any version, so decide by the status.
 *
 * @param error The error; may be NULL.
 * @return A string that lives as long as the error; "" for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_error_message(const ptzcal_error *error) PTZCAL_NOEXCEPT;

/**
 * What the user can do about it, one line of English UTF-8.
 *
 * @param error The error; may be NULL.
 * @return A string that lives as long as the error; "" when there is nothing to say, and for NULL;
 *         never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_error_hint(const ptzcal_error *error) PTZCAL_NOEXCEPT;

/**
 * Which point, view or sample is at fault, counted from 0.
 *
 * @param error The error; may be NULL.
 * @return The index, or -1 when no single one is at fault, and for NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
int64_t ptzcal_error_index(const ptzcal_error *error) PTZCAL_NOEXCEPT;

/**
 * Frees an error. Strings taken from it die with it.
 *
 * @param error The error; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_error_free(ptzcal_error *error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Limits
 *
 * Sizes above these are refused with PTZCAL_STATUS_INVALID_ARGUMENT.
 * ============================================================================================= */

/**
 * Most elements (points, shots, frames, numbers of a buffer) that one argument may have. It keeps
 * every product of sizes from overflowing, and an uninitialised count from being believed.
 */
#define PTZCAL_MAX_COUNT 268435456

/** Longest string that is accepted, in bytes, its NUL not counted. */
#define PTZCAL_MAX_STRING 4096

/* ================================================================================================
 * Cancelling
 *
 * Long work runs on the thread that calls it. To stop it from another thread, make a token, hand it
 * to the work's options, and request cancellation: the call ends with PTZCAL_STATUS_CANCELLED. The
 * work looks at the token several times a second, except while it waits inside a callback of
 * yours or inside a device. One token may be given to any number of calls. The options keep what
 * they need of it, so it may be freed at any time; a token that is freed can just not be requested
 * any more.
 * ============================================================================================= */

/** Stops long work from any thread. */
typedef struct ptzcal_cancel ptzcal_cancel;

/**
 * Makes a token that is not requested.
 *
 * @param token Receives the token; free it with ptzcal_cancel_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cancel_new(ptzcal_cancel **token, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Requests that all work which has this token stops. May be called again, from any thread, and
 * from a signal handler: it only stores a flag.
 *
 * @param token The token.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cancel_request(const ptzcal_cancel *token) PTZCAL_NOEXCEPT;

/**
 * Takes a request back, so that the token can be used for the next work. Work that is still
 * running may or may not have seen the request.
 *
 * @param token The token.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cancel_reset(const ptzcal_cancel *token) PTZCAL_NOEXCEPT;

/**
 * Has cancellation been requested?
 *
 * @param token The token; may be NULL.
 * @return 1 when it was requested, else 0; 0 for NULL.
 *
 * Threads: free.
 * Since 0.1.0.
 */
int32_t ptzcal_cancel_is_requested(const ptzcal_cancel *token) PTZCAL_NOEXCEPT;

/**
 * Frees a token. Work that was given it goes on undisturbed.
 *
 * @param token The token; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_cancel_free(ptzcal_cancel *token) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Logging
 *
 * The library never prints. Where a verb takes a log callback, messages go there; without one they
 * are not even made.
 * ============================================================================================= */

/** How much a message matters. */
enum {
  /** Something failed. */
  PTZCAL_LOG_LEVEL_ERROR = 1,
  /** Something is not as it should be, but the work goes on. */
  PTZCAL_LOG_LEVEL_WARNING = 2,
  /** What is being done. */
  PTZCAL_LOG_LEVEL_INFO = 3,
  /** Details for whoever searches a fault. */
  PTZCAL_LOG_LEVEL_DEBUG = 4,
};
typedef int32_t ptzcal_log_level;

/**
 * Receives a message: one line of English UTF-8, valid during the call. It runs on the thread that
 * called the library, never under a lock of the library, and must not throw or longjmp.
 *
 * @param user    What was given with the callback.
 * @param level   A ptzcal_log_level; treat unknown ones as PTZCAL_LOG_LEVEL_DEBUG.
 * @param message The message.
 */
typedef void (*ptzcal_log_fn)(void *user, int32_t level, const char *message) PTZCAL_CALLBACK_NOEXCEPT;

/* ================================================================================================
 * Laser shots
 *
 * One position of a scan: where the head stood, and what its camera's spot says.
 * ============================================================================================= */

/** One position of a scan. */
typedef struct ptzcal_shot {
  /** Set by ptzcal_shot_init. */
  uint32_t struct_size;
  /** Position in the region: tilt step * pan_steps + pan step. */
  uint32_t index;
  /** The device's reading, radians. */
  double pan;
  /** The device's reading, radians. */
  double tilt;
  /** The device's own zoom scale. */
  double zoom;
  /** Seconds of the rig's clock. */
  double time;
  /** 1 when the head camera saw the spot; point, covariance and inverse depth are 0 otherwise. */
  uint32_t found;
  /** 1 when the point has a finite depth; point and covariance are 0 otherwise. */
  uint32_t has_point;
  /** How many fixed cameras saw the spot. */
  uint32_t fixed_found;
  /** What the head camera saw there without the laser: 0xRRGGBB. */
  uint32_t colour;
  /** The point in the rig's world, metres. */
  double point[3];
  /** Its covariance, row-major, m^2; of rank one, along the laser's line. */
  double covariance[9];
  /** 1 / depth along the head camera's axis, 1 / m; its noise is Gaussian. */
  double inverse_depth;
  /** Its variance, 1 / m^2. */
  double inverse_depth_variance;
  /** Squared distance of the spot from the laser's image line in standard deviations: about 1. */
  double epipolar_chi2;
} ptzcal_shot;

/**
 * Sets up a shot: everything 0.
 *
 * @param shot The struct.
 * @param size sizeof *shot.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_shot_init(ptzcal_shot *shot, size_t size) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Progress
 *
 * Long verbs take a callback that hears how far the work is and can stop it.
 * ============================================================================================= */

/** How far the work is. The library fills it in; `struct_size` says which members there are. */
typedef struct ptzcal_progress {
  /**
   * Size of the struct as the library knows it. Look at it before you read a member that is
   * newer than the library you must run with.
   */
  uint32_t struct_size;
  /** Which pass over the work this is, from 1. */
  uint32_t pass;
  /** How many passes there will be. */
  uint32_t passes;
  /** 1 when the newest step gave a measurement, 0 when it gave none. */
  uint32_t measured;
  /** Steps of this pass that are done. */
  uint64_t done;
  /** Steps of this pass in all. */
  uint64_t total;
  /** Seconds since the work began. */
  double elapsed;
  /** Estimated seconds until it is done; negative while nobody knows. */
  double seconds_left;
  /**
   * A scan's newest shot, safe in the journal if there is one; NULL before the first, and for work
   * that is no scan.
   */
  const ptzcal_shot *shot;
} ptzcal_progress;

/**
 * Hears about progress. It runs on the thread that called the verb, never under a lock of the
 * library, and must not throw or longjmp. It may call the library, but not with the handle that is
 * at work (PTZCAL_STATUS_BUSY).
 *
 * @param user     What was given with the callback.
 * @param progress Valid during the call.
 * @return 0 to go on; any other number stops the work. A scan that is stopped returns what it has.
 */
typedef int32_t (*ptzcal_progress_fn)(void *user, const ptzcal_progress *progress) PTZCAL_CALLBACK_NOEXCEPT;

/* ================================================================================================
 * Images
 *
 * Images are borrowed for the call: the library reads your memory where it is, keeps no pointer to
 * it, and never writes to it. All 8 bits per sample.
 * ============================================================================================= */

/** Layouts of pixels in memory: the values of ptzcal_image.format. */
enum {
  /** One byte per pixel. */
  PTZCAL_PIXEL_FORMAT_GRAY8 = 1,
  /** R, G, B. */
  PTZCAL_PIXEL_FORMAT_RGB24 = 2,
  /** B, G, R. */
  PTZCAL_PIXEL_FORMAT_BGR24 = 3,
  /** R, G, B, ignored. */
  PTZCAL_PIXEL_FORMAT_RGBA32 = 4,
  /** B, G, R, ignored. */
  PTZCAL_PIXEL_FORMAT_BGRA32 = 5,
  /** Y0 U Y1 V for two pixels; the width is even. */
  PTZCAL_PIXEL_FORMAT_YUYV = 6,
  /** Plane 0: Y; plane 1: U, V interleaved, half the size in both directions, rounded up. */
  PTZCAL_PIXEL_FORMAT_NV12 = 7,
  /** Plane 0: Y; plane 1: U; plane 2: V, both half the size in both directions, rounded up. */
  PTZCAL_PIXEL_FORMAT_I420 = 8,
};
typedef uint32_t ptzcal_pixel_format;

/**
 * An image in the caller's memory.
 *
 * `plane[i]` points at the first byte of the top row. `stride[i]` is the distance in bytes from a
 * row to the next one below it: negative for an image stored bottom-up, at least a row's bytes in
 * size. `size[i]` is the number of bytes that may be read, counted from the plane's LOWEST address:
 * that is `plane[i]`, or the beginning of the bottom row when the stride is negative. Planes that
 * the format does not have are ignored.
 *
 * A packed, top-down GRAY8 image:
 * `image.plane[0] = pixels; image.stride[0] = width; image.size[0] = width * height;`
 */
typedef struct ptzcal_image {
  /** Set by ptzcal_image_init. */
  uint32_t struct_size;
  /** A ptzcal_pixel_format. */
  uint32_t format;
  /** Pixels, 1 to 65536. */
  uint32_t width;
  /** Pixels, 1 to 65536. */
  uint32_t height;
  /** First byte of the top row of each plane. */
  const void *plane[4];
  /** Bytes from a row to the one below; negative = bottom-up. */
  ptrdiff_t stride[4];
  /** Readable bytes from the plane's lowest address. */
  size_t size[4];
} ptzcal_image;

/**
 * Sets up an image view: no planes, no format.
 *
 * @param image The struct.
 * @param size  sizeof *image.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_image_init(ptzcal_image *image, size_t size) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Pictures
 *
 * Photographs from files, and pictures of what was found: an image with marks on it, written as PNG.
 * Colours are 0xRRGGBB. Marks outside the picture, or at places that are not finite, are left out.
 * ============================================================================================= */

/** A picture in the library's memory. */
typedef struct ptzcal_picture ptzcal_picture;

/**
 * Reads a photograph: PNG, JPEG or PNM, told by what it holds; 16 bits per sample are cut to 8.
 *
 * @param path    The file.
 * @param picture Receives the picture; free it with ptzcal_picture_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_read(const char *path,
                                  ptzcal_picture **picture,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies an image, to draw on it.
 *
 * @param image   The image.
 * @param picture Receives the picture; free it with ptzcal_picture_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image;
 *         PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_new(const ptzcal_image *image,
                                 ptzcal_picture **picture,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies two images side by side, to draw what matches in them.
 *
 * @param left    The left one.
 * @param right   The right one; it begins at x = the left one's width.
 * @param picture Receives the picture; free it with ptzcal_picture_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image, and for two that are
 *         together wider than 65536 pixels; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_beside(const ptzcal_image *left,
                                    const ptzcal_image *right,
                                    ptzcal_picture **picture,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a picture.
 *
 * @param picture The picture; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_picture_free(ptzcal_picture *picture) PTZCAL_NOEXCEPT;

/**
 * The picture's pixels, for every function that takes an image. They stay where they are until the
 * picture is freed; drawing changes them.
 *
 * @param picture The picture.
 * @param image   Receives the view; set up by ptzcal_image_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY while another thread draws.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_image(const ptzcal_picture *picture,
                                   ptzcal_image *image,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a picture as PNG, at once or not at all.
 *
 * @param picture The picture.
 * @param path    The file.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_save(const ptzcal_picture *picture,
                                  const char *path,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Darkens a picture, so that marks stand out.
 *
 * @param picture The picture.
 * @param light   What is left of its light, 0 to 1.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_dim(ptzcal_picture *picture,
                                 double light,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws lines.
 *
 * @param picture The picture.
 * @param ends    n x 4 numbers: x, y of the one end and of the other, pixels.
 * @param n       Number of lines.
 * @param width   Width of the lines, pixels.
 * @param colour  0xRRGGBB.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_draw_lines(ptzcal_picture *picture,
                                        const double *ends,
                                        size_t n,
                                        double width,
                                        uint32_t colour,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws circles.
 *
 * @param picture The picture.
 * @param centres n x 2 numbers, pixels.
 * @param n       Number of circles.
 * @param radius  Radius, pixels.
 * @param width   Width of the line, pixels.
 * @param colour  0xRRGGBB.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_draw_circles(ptzcal_picture *picture,
                                          const double *centres,
                                          size_t n,
                                          double radius,
                                          double width,
                                          uint32_t colour,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws a chessboard's corners, as ptzcal_detect_chessboard gives them: each row in a colour, joined in
 * order, a ring around the first.
 *
 * @param picture The picture.
 * @param corners columns x rows x 2 numbers, pixels.
 * @param found   columns x rows numbers: 0 where there is no corner; may be NULL: all are there.
 * @param columns Corners in a row.
 * @param rows    Corners in a column.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_draw_board(ptzcal_picture *picture,
                                        const double *corners,
                                        const uint8_t *found,
                                        size_t columns,
                                        size_t rows,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws residuals as arrows from where each point was seen; outliers are red rings.
 *
 * @param picture   The picture.
 * @param uv        n x 2 numbers: where the points were seen, pixels.
 * @param residuals n x 2 numbers, pixels; they may be infinite: those are left out.
 * @param inliers   n numbers: 0 for outliers; may be NULL: there are none.
 * @param n         Number of points.
 * @param scale     How much longer than the residuals the arrows are.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_draw_residuals(ptzcal_picture *picture,
                                            const double *uv,
                                            const double *residuals,
                                            const uint8_t *inliers,
                                            size_t n,
                                            double scale,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws pairs of points of two pictures that stand side by side (ptzcal_picture_beside): kept ones are
 * joined by a line, the others are red rings.
 *
 * @param picture The picture.
 * @param left    n x 2 numbers, pixels of the left picture.
 * @param right   n x 2 numbers, pixels of the right picture.
 * @param kept    n numbers: 0 for pairs that are not kept; may be NULL: all are.
 * @param n       Number of pairs.
 * @param offset  Width of the left picture, pixels.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_picture_draw_matches(ptzcal_picture *picture,
                                          const double *left,
                                          const double *right,
                                          const uint8_t *kept,
                                          size_t n,
                                          double offset,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Depth maps
 *
 * For every pixel of a camera the depth along its optical axis: as depth cameras give it, registered
 * to their colour image, or as a cloud or mesh has it (ptzcal_cloud_depth_map, ptzcal_mesh_depth_map).
 * The map is a copy: the caller's memory is free after the call.
 * ============================================================================================= */

/** Depths of an image's pixels. Immutable: any number of threads may read it. */
typedef struct ptzcal_depth_map ptzcal_depth_map;

/**
 * Makes a depth map of 16-bit values, as most depth cameras give; 0 is no depth.
 *
 * @param values Rows from the top, `stride` values apart.
 * @param width  Pixels.
 * @param height Pixels.
 * @param stride Values from a row to the next, at least `width`.
 * @param metres Metres per unit: 0.001 for millimetres.
 * @param map    Receives the map; free it with ptzcal_depth_map_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_new_u16(const uint16_t *values,
                                       uint32_t width,
                                       uint32_t height,
                                       size_t stride,
                                       double metres,
                                       ptzcal_depth_map **map,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes a depth map of floats; what is not a positive number (0, negative, NaN, infinite) is no depth.
 *
 * @param values Rows from the top, `stride` values apart.
 * @param width  Pixels.
 * @param height Pixels.
 * @param stride Values from a row to the next, at least `width`.
 * @param metres Metres per unit: 1 for metres.
 * @param map    Receives the map; free it with ptzcal_depth_map_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE for `metres`.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_new_f32(const float *values,
                                       uint32_t width,
                                       uint32_t height,
                                       size_t stride,
                                       double metres,
                                       ptzcal_depth_map **map,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads a depth map: a PNG or PGM with one channel of 16 bits; 0 is no depth.
 *
 * @param path   The file.
 * @param metres Metres per unit: 0.001 for millimetres.
 * @param map    Receives the map; free it with ptzcal_depth_map_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_read(const char *path,
                                    double metres,
                                    ptzcal_depth_map **map,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a depth map.
 *
 * @param map The map; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_depth_map_free(ptzcal_depth_map *map) PTZCAL_NOEXCEPT;

/**
 * Size of a depth map and how many of its pixels have a depth.
 *
 * @param map    The map.
 * @param width  Receives the width, pixels; may be NULL.
 * @param height Receives the height, pixels; may be NULL.
 * @param known  Receives the number of pixels with a depth; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_size(const ptzcal_depth_map *map,
                                    uint32_t *width,
                                    uint32_t *height,
                                    size_t *known,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the depths: width x height numbers, row by row, metres; 0 where there is none.
 *
 * @param map      The map.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_copy_metres(const ptzcal_depth_map *map,
                                           float *buffer,
                                           size_t capacity,
                                           size_t *needed,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the variances of a map that was made of a cloud or mesh: width x height numbers, row by row,
 * m^2; 0 where there is no depth.
 *
 * @param map      The map.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where the noise is
 *         unknown.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_copy_variances(const ptzcal_depth_map *map,
                                              float *buffer,
                                              size_t capacity,
                                              size_t *needed,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a depth map as a PNG with one channel of 16 bits; 0 is no depth.
 *
 * @param map    The map.
 * @param path   The file.
 * @param metres Metres per unit: 0.001 for millimetres, up to 65.535 m.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for units in which a depth is none, or too
 *         large; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_depth_map_save(const ptzcal_depth_map *map,
                                    const char *path,
                                    double metres,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Cameras
 *
 * A calibrated camera is plain data: fill it in yourself or take it from a calibration. A world
 * point X is at x = R X + t in the camera frame (x right, y down, z forward), at (x/z, y/z) on the
 * normalised plane, there distorted by the lens to (a, b), and at u = fx a + skew b + cx,
 * v = fy b + cy in the image. A fisheye lens gives (a, b) from the ray itself, also at and beyond
 * 90 degrees from the axis, where z is not positive.
 * ============================================================================================= */

/** Lens models: the values of ptzcal_camera.distortion_model and ptzcal_rig_model.distortion_model. */
enum {
  /** No distortion, no coefficients. */
  PTZCAL_DISTORTION_MODEL_NONE = 0,
  /**
   * The Brown-Conrady model with k1 only. A calibration that fits it returns a BROWN_CONRADY
   * camera whose other coefficients are 0.
   */
  PTZCAL_DISTORTION_MODEL_RADIAL1 = 1,
  /** The Brown-Conrady model with k1 and k2 only. */
  PTZCAL_DISTORTION_MODEL_RADIAL2 = 2,
  /**
   * Brown-Conrady, the five coefficients k1 k2 p1 p2 k3 with OpenCV's meaning and order:
   * a = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
   * b = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y.
   */
  PTZCAL_DISTORTION_MODEL_BROWN_CONRADY = 3,
  /**
   * Division model, one coefficient lambda: (x, y) = (a, b) / (1 + lambda (a^2 + b^2)).
   * Negative is barrel distortion. In units of the normalised plane.
   */
  PTZCAL_DISTORTION_MODEL_DIVISION = 4,
  /**
   * Fisheye (Kannala-Brandt), the four coefficients k1 k2 k3 k4 with OpenCV's meaning and order: a
   * ray at the angle theta from the axis is imaged at the radius
   * theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8) on the normalised plane. Sees
   * beyond 90 degrees, up to the angle at which the radius stops growing.
   */
  PTZCAL_DISTORTION_MODEL_FISHEYE = 5,
};
typedef uint32_t ptzcal_distortion_model;

/** A calibrated camera. */
typedef struct ptzcal_camera {
  /** Set by ptzcal_camera_init. */
  uint32_t struct_size;
  /** Image size in pixels, 1 to 65536. */
  uint32_t width;
  /** Image size in pixels, 1 to 65536. */
  uint32_t height;
  /** A ptzcal_distortion_model. */
  uint32_t distortion_model;
  /** Focal length in pixels of x, positive. */
  double fx;
  /** Focal length in pixels of y, positive. */
  double fy;
  /** K[0][1], pixels; 0 for practically all cameras. */
  double skew;
  /** Principal point, pixels; (0, 0) is the centre of the top-left pixel. */
  double cx;
  /** Principal point, pixels. */
  double cy;
  /** The model's coefficients in the model's order; those that the model does not have are 0. */
  double distortion[8];
  /** R, row-major: world axes to camera axes, a rotation to within 1e-6. */
  double rotation[9];
  /** t, metres: the world's origin in the camera frame. The camera's centre is -R^T t. */
  double translation[3];
} ptzcal_camera;

/**
 * Sets up a camera: rotation 1, no distortion, everything else 0 (image size and focal lengths
 * must still be set).
 *
 * @param camera The struct.
 * @param size   sizeof *camera.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_init(ptzcal_camera *camera, size_t size) PTZCAL_NOEXCEPT;

/**
 * Centre of a camera in the world, -R^T t.
 *
 * @param camera The camera.
 * @param centre Receives 3 numbers, metres, world frame.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_centre(const ptzcal_camera *camera,
                                   double *centre,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Projects world points into the image, lens distortion included. Pixels outside the image are not
 * an error: compare them with the image size.
 *
 * @param camera The camera.
 * @param xyz    n x 3 numbers: points, metres, world frame.
 * @param n      Number of points.
 * @param uv     Receives n x 2 numbers: pixels. May be the same memory as xyz.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first point that is behind the
 *         camera); PTZCAL_STATUS_OUTSIDE_LENS (index: the first point that the lens model has no
 *         image of); PTZCAL_STATUS_NOT_FINITE (index: the point).
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_project(const ptzcal_camera *camera,
                                    const double *xyz,
                                    size_t n,
                                    double *uv,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The viewing rays of pixels: from the camera's centre (ptzcal_camera_centre), lens distortion
 * removed.
 *
 * @param camera     The camera.
 * @param uv         n x 2 numbers: pixels.
 * @param n          Number of pixels.
 * @param directions Receives n x 3 numbers: unit vectors in the world frame.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel that no ray reaches
 *         through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel).
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_back_project(const ptzcal_camera *camera,
                                         const double *uv,
                                         size_t n,
                                         double *directions,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Images without lens distortion
 *
 * Draws what an ideal camera, without a lens, would see from the place of a calibrated one: straight
 * lines are straight in its pictures. It may look elsewhere and have another size and focal length,
 * so that a part of a fixed camera's picture can be turned and zoomed as a pan-tilt-zoom camera's. The
 * positions are made once; then each image takes little more than its memory does.
 * ============================================================================================= */

/** Takes the lens distortion out of a camera's images. Immutable: any number of threads may use it. */
typedef struct ptzcal_undistorter ptzcal_undistorter;

/**
 * The ideal camera that shows what a camera sees: at its place, of its size, its rotation and its
 * ratio of focal lengths, without lens and skew. Change its rotation, focal lengths, principal point or
 * size for another view.
 *
 * @param camera The calibrated camera.
 * @param keep   How much of the image's border is kept, as the alpha of OpenCV's
 *               getOptimalNewCameraMatrix. 0: the largest view whose pixels are all inside the image; 1: the
 *               smallest that holds all pixels of the image, with empty margins; between them something
 *               between.
 * @param ideal  Receives the ideal camera; set up by ptzcal_camera_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an image of fewer than 2 pixels on a side
 *         and for a lens that sees 180 degrees or more, unless keep is 0 and a part of its image's border
 *         is less far out; PTZCAL_STATUS_LENS_NOT_MONOTONE where the lens model folds back inside the
 *         image; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_undistorted(const ptzcal_camera *camera,
                                        double keep,
                                        ptzcal_camera *ideal,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes an undistorter. Both cameras look from the same place: of the ideal camera's pose only the
 * rotation counts, its translation becomes the one that goes with the camera's centre.
 *
 * @param camera      The calibrated camera, of any lens model.
 * @param ideal       The ideal camera, as ptzcal_camera_undistorted gives it or any other without a lens;
 *                    2^26 pixels at most.
 * @param undistorter Receives the undistorter; free it with ptzcal_undistorter_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, also for an ideal camera with a lens;
 *         PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_undistorter_new(const ptzcal_camera *camera,
                                     const ptzcal_camera *ideal,
                                     ptzcal_undistorter **undistorter,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees an undistorter.
 *
 * @param undistorter The undistorter; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_undistorter_free(ptzcal_undistorter *undistorter) PTZCAL_NOEXCEPT;

/**
 * The ideal camera, whose pictures an undistorter draws: with it points are projected into them and
 * pixels of them back into the world (ptzcal_camera_project, ptzcal_camera_back_project).
 *
 * @param undistorter The undistorter.
 * @param camera      Receives the ideal camera; set up by ptzcal_camera_init.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_undistorter_get_camera(const ptzcal_undistorter *undistorter,
                                            ptzcal_camera *camera,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws the ideal camera's picture. Pixels outside the image are black (all bytes 0).
 *
 * @param undistorter The undistorter.
 * @param image       The calibrated camera's image, of its size: GRAY8, RGB24, BGR24, RGBA32 or BGRA32. Of
 *                    NV12 and I420 the Y plane alone is a GRAY8 image.
 * @param pixels      Receives n bytes: the picture, in the image's format. Not the image's memory. What is
 *                    between the rows stays as it is.
 * @param n           Number of bytes; for a picture of height h at least |stride| (h - 1) and a row's bytes.
 * @param stride      Bytes from a row to the one below; negative = bottom-up: the bottom row is the first in
 *                    memory.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an image of another size than the
 *         camera's; PTZCAL_STATUS_UNSUPPORTED for other formats; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_undistorter_apply(const ptzcal_undistorter *undistorter,
                                       const ptzcal_image *image,
                                       uint8_t *pixels,
                                       size_t n,
                                       ptrdiff_t stride,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws a part of the ideal camera's picture: a tile that is shown, or a thread's share of the rows.
 *
 * @param undistorter The undistorter.
 * @param image       As for ptzcal_undistorter_apply.
 * @param x           First column.
 * @param y           First row.
 * @param width       Columns, at least 1; the region is inside the ideal camera's picture.
 * @param height      Rows, at least 1.
 * @param border      4 bytes: the value of pixels outside the image, of which as many count as a pixel of its
 *                    format has; may be NULL: 0.
 * @param pixels      Receives n bytes: the region's pixels, as for ptzcal_undistorter_apply.
 * @param n           Number of bytes.
 * @param stride      As for ptzcal_undistorter_apply.
 * @param error       Receives the error; may be NULL.
 * @return As for ptzcal_undistorter_apply; PTZCAL_STATUS_INVALID_ARGUMENT also for a region that is not
 *         inside the picture.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_undistorter_apply_region(const ptzcal_undistorter *undistorter,
                                              const ptzcal_image *image,
                                              uint32_t x,
                                              uint32_t y,
                                              uint32_t width,
                                              uint32_t height,
                                              const uint8_t *border,
                                              uint8_t *pixels,
                                              size_t n,
                                              ptrdiff_t stride,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Rig models
 *
 * Everything that turns a laser shot (pan, tilt, the spot's pixel in the head camera) into a point:
 * the head camera's intrinsics and lens, the laser's line, the rotation axes, the encoders. The
 * world of a rig is its head camera's frame at pan = tilt = 0; positive pan turns the view right,
 * positive tilt turns it up.
 * ============================================================================================= */

/** A pan-tilt camera with a laser fixed to its moving head. */
typedef struct ptzcal_rig_model {
  /** Set by ptzcal_rig_model_init. */
  uint32_t struct_size;
  /** Image size of the head camera in pixels, 1 to 65536. */
  uint32_t width;
  /** Image size of the head camera in pixels, 1 to 65536. */
  uint32_t height;
  /** A ptzcal_distortion_model. */
  uint32_t distortion_model;
  /** Focal length in pixels of x, positive. */
  double fx;
  /** Focal length in pixels of y, positive. */
  double fy;
  /** K[0][1], pixels. */
  double skew;
  /** Principal point, pixels. */
  double cx;
  /** Principal point, pixels. */
  double cy;
  /** The lens model's coefficients; those that the model does not have are 0. */
  double distortion[8];
  /** The laser's line in the head camera's frame is (x0 + vx Z, y0 + vy Z, Z). Metres. */
  double laser_x0;
  /** Metres. (x0, y0) is the baseline: at least 1 mm long. */
  double laser_y0;
  /** Slope, metres per metre of depth. */
  double laser_vx;
  /** Slope, metres per metre of depth. */
  double laser_vy;
  /**
   * The tilt axis (parallel to x) passes through (y, z) = -(tilt_y, tilt_z) of the head camera's
   * frame. Metres; 0: through the camera's centre.
   */
  double axis_tilt_y;
  /** Metres. */
  double axis_tilt_z;
  /** The pan axis (parallel to y) is displaced from the tilt axis by (pan_x, pan_z). Metres. */
  double axis_pan_x;
  /** Metres. */
  double axis_pan_z;
  /** True pan = pan_scale * reading + pan_zero. Radians. */
  double pan_zero;
  /** 1 for a true encoder. */
  double pan_scale;
  /** True tilt = tilt_scale * reading + tilt_zero. Radians. */
  double tilt_zero;
  /** 1 for a true encoder. */
  double tilt_scale;
} ptzcal_rig_model;

/**
 * Sets up a rig model: true encoders, axes through the camera's centre, no distortion, everything
 * else 0 (image size, focal lengths and the laser's line must still be set).
 *
 * @param model The struct.
 * @param size  sizeof *model.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_model_init(ptzcal_rig_model *model, size_t size) PTZCAL_NOEXCEPT;

/**
 * The head camera as a camera of the world, at given encoder readings.
 *
 * @param model  The rig model.
 * @param pan    Reading, radians.
 * @param tilt   Reading, radians.
 * @param camera Receives the camera; set up by ptzcal_camera_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_model_head_camera(const ptzcal_rig_model *model,
                                           double pan,
                                           double tilt,
                                           ptzcal_camera *camera,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The points that laser shots hit. Depth comes from both coordinates of each spot, weighted by its
 * covariance; far away it is uncertain and skewed, so hand shots to a calibration as shots
 * (ptzcal_correspondences_add_laser_shots), not as these points.
 *
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy of each spot, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param xyz             Receives n x 3 numbers: points, metres, world frame.
 * @param covariance      Receives n x 9 numbers: first-order covariance of each point, row-major,
 *                        m^2 (rank one, along the beam); may be NULL.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first shot whose spot lies at or
 *         beyond infinity); PTZCAL_STATUS_NOT_FINITE (index: the shot);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a spot outside the lens model or a covariance that is
 *         not positive definite.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_model_locate(const ptzcal_rig_model *model,
                                      const double *pan_tilt,
                                      const double *spots,
                                      const double *spot_covariance,
                                      size_t n,
                                      double *xyz,
                                      double *covariance,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Detecting the laser's spot
 *
 * Takes frames with the laser on and, much better, frames of the same view with it off. No rig is
 * needed. The answer is a spot with its covariance, or PTZCAL_STATUS_NOT_FOUND or
 * PTZCAL_STATUS_AMBIGUOUS: never a guess.
 * ============================================================================================= */

/** Colours of the laser: the values of ptzcal_spot_options_set_colour. */
enum {
  /** Whichever channel differs most between on and off. */
  PTZCAL_LASER_COLOUR_UNKNOWN = 0,
  PTZCAL_LASER_COLOUR_RED = 1,
  PTZCAL_LASER_COLOUR_GREEN = 2,
  PTZCAL_LASER_COLOUR_BLUE = 3,
  /** Infrared, or a monochrome camera: all channels alike. */
  PTZCAL_LASER_COLOUR_WHITE = 4,
};
typedef uint32_t ptzcal_laser_colour;

/** How a spot is searched. */
typedef struct ptzcal_spot_options ptzcal_spot_options;

/** A spot found. */
typedef struct ptzcal_spot {
  /** Set by ptzcal_spot_init. */
  uint32_t struct_size;
  /** 1 when pixels of the spot are at the sensor's limit, else 0. */
  uint32_t saturated;
  /** Centre, pixels; (0, 0) is the centre of the top-left pixel. */
  double x;
  /** Centre, pixels. */
  double y;
  /** Covariance of the centre, px^2: xx, xy, yy. */
  double covariance[3];
  /** Greatest difference between on and off, grey levels (0 to 255). */
  double peak;
  /** Summed signal over its standard deviation under the frames' noise. */
  double signal_to_noise;
  /** Pixels above the threshold. */
  uint64_t area;
} ptzcal_spot;

/**
 * Sets up a spot: everything 0.
 *
 * @param spot The struct.
 * @param size sizeof *spot.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_init(ptzcal_spot *spot, size_t size) PTZCAL_NOEXCEPT;

/**
 * Makes options with their defaults: the whole image, any colour, a signal-to-noise ratio of 8.
 *
 * @param options Receives the options; free them with ptzcal_spot_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_new(ptzcal_spot_options **options,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_spot_options_free(ptzcal_spot_options *options) PTZCAL_NOEXCEPT;

/**
 * Searches only a rectangle: columns x to x + width - 1, rows y to y + height - 1. With a band set
 * as well, both must hold.
 *
 * @param options The options.
 * @param x       First column.
 * @param y       First row.
 * @param width   Columns, at least 1.
 * @param height  Rows, at least 1.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_region(ptzcal_spot_options *options,
                                             uint32_t x,
                                             uint32_t y,
                                             uint32_t width,
                                             uint32_t height,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Searches only a band about a line of pixels, such as the epipolar line on which the laser's spot
 * must lie. The line may bend, as epipolar lines do behind a lens.
 *
 * @param options    The options.
 * @param polyline   n x 2 numbers: corners of the line, pixels.
 * @param n          Number of corners, at least 2.
 * @param half_width Greatest distance from the line, pixels, positive.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the corner).
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_band(ptzcal_spot_options *options,
                                           const double *polyline,
                                           size_t n,
                                           double half_width,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Tells the laser's colour, so that other changes in the image weigh less.
 *
 * @param options The options.
 * @param colour  A ptzcal_laser_colour.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_colour(ptzcal_spot_options *options,
                                             uint32_t colour,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the least signal-to-noise ratio of a spot that is believed.
 *
 * @param options The options.
 * @param ratio   Positive; the default is 8.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_min_signal_to_noise(ptzcal_spot_options *options,
                                                          double ratio,
                                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the greatest area of a spot; larger changes are people, lamps or shadows.
 *
 * @param options The options.
 * @param area    Pixels, at least 1; the default is 5000.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_max_area(ptzcal_spot_options *options,
                                               uint32_t area,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how strong a second candidate may be: at this fraction of the best one's strength or more
 * the answer is PTZCAL_STATUS_AMBIGUOUS.
 *
 * @param options The options.
 * @param ratio   Above 0, at most 1; the default is 0.5.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_options_set_ambiguity_ratio(ptzcal_spot_options *options,
                                                      double ratio,
                                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds the laser's spot in one frame with the laser on, against one with it off.
 *
 * @param on      The frame with the laser on.
 * @param off     The same view with the laser off, of the same size and format; may be NULL: the
 *                search then knows no background and is much weaker.
 * @param options The options; may be NULL: the defaults.
 * @param spot    Receives the spot; set up by ptzcal_spot_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND; PTZCAL_STATUS_AMBIGUOUS;
 *         PTZCAL_STATUS_BUFFER_TOO_SMALL when a plane's size cannot hold the image;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for images that are malformed or do not match.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_spot(const ptzcal_image *on,
                                 const ptzcal_image *off,
                                 const ptzcal_spot_options *options,
                                 ptzcal_spot *spot,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds the laser's spot in several frames with the laser on, averaged, against several with it
 * off, averaged: noise falls with the square root of their number.
 *
 * @param on      n_on frames with the laser on, all of one size and format.
 * @param n_on    Number of frames, at least 1.
 * @param off     n_off frames of the same view with the laser off; may be NULL when n_off is 0.
 * @param n_off   Number of frames; 0: a much weaker search, without a background.
 * @param options The options; may be NULL: the defaults.
 * @param spot    Receives the spot; set up by ptzcal_spot_init.
 * @param error   Receives the error; may be NULL.
 * @return As ptzcal_detect_spot.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_spot_averaged(const ptzcal_image *const *on,
                                          size_t n_on,
                                          const ptzcal_image *const *off,
                                          size_t n_off,
                                          const ptzcal_spot_options *options,
                                          ptzcal_spot *spot,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * A spot detector for frame after frame
 *
 * ptzcal_detect_spot with memory of its own: once it has seen frames like those to come, it allocates no
 * more for a spot that it finds among up to 8 frames. For hosts that look at every frame of a stream.
 * ============================================================================================= */

/** A spot detector. One thread at a time may use it; have one for each camera. */
typedef struct ptzcal_spot_detector ptzcal_spot_detector;

/**
 * Makes a detector.
 *
 * @param options  The options, which are copied; may be NULL: the defaults.
 * @param detector Receives the detector; free it with ptzcal_spot_detector_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_detector_new(const ptzcal_spot_options *options,
                                       ptzcal_spot_detector **detector,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a detector.
 *
 * @param detector The detector; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_spot_detector_free(ptzcal_spot_detector *detector) PTZCAL_NOEXCEPT;

/**
 * Finds the laser's spot, as ptzcal_detect_spot_averaged does: what the detector saw before does not
 * change the answer.
 *
 * @param detector The detector.
 * @param on       n_on frames with the laser on, all of one size and format.
 * @param n_on     Number of frames, at least 1.
 * @param off      n_off frames of the same view with the laser off; may be NULL when n_off is 0.
 * @param n_off    Number of frames; 0: a much weaker search, without a background.
 * @param spot     Receives the spot; set up by ptzcal_spot_init.
 * @param error    Receives the error; may be NULL.
 * @return As ptzcal_detect_spot; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_spot_detector_detect(ptzcal_spot_detector *detector,
                                          const ptzcal_image *const *on,
                                          size_t n_on,
                                          const ptzcal_image *const *off,
                                          size_t n_off,
                                          ptzcal_spot *spot,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Detecting chessboards
 *
 * Finds the inner corners of a chessboard, where four squares meet, in one image. A board of c x r
 * inner corners has (c + 1) x (r + 1) squares. Every corner comes with its covariance, so that it can
 * be weighed in a calibration.
 *
 * The order: row by row. From column to column and then from row to row one turns clockwise as seen
 * in the image; a mirrored view is read as its mirror image. Of the orders that are left, those come
 * first whose first corner has a dark square diagonally outside; of several, the one whose first
 * corner has the least x + y. With one even and one odd number of corners the order is the board's
 * own, however the camera is turned. Otherwise a view turned by 180 degrees (90 on square boards)
 * looks the same.
 * ============================================================================================= */

/** Which chessboard is looked for. */
typedef struct ptzcal_chessboard_options {
  /** Set by ptzcal_chessboard_options_init. */
  uint32_t struct_size;
  /** Inner corners in a row, 3 to 128; 0, with rows 0 too: any size. */
  uint32_t columns;
  /** Inner corners in a column, 3 to 128. */
  uint32_t rows;
  /** 0. */
  uint32_t reserved;
  /**
   * Least share of the corners that must be found, 0 to 1; never fewer than 8 corners. Some corner of
   * each outer row and column must be among them.
   */
  double min_found;
} ptzcal_chessboard_options;

/** A chessboard found. */
typedef struct ptzcal_chessboard {
  /** Set by ptzcal_chessboard_init. */
  uint32_t struct_size;
  /** Inner corners in a row; of a board of unknown size the larger number. */
  uint32_t columns;
  /** Inner corners in a column. */
  uint32_t rows;
  /** Number of corners found, at most columns x rows. */
  uint32_t found;
  /** Standard deviation of the image's blur at the corners, pixels. */
  double blur;
} ptzcal_chessboard;

/**
 * Sets up options with their defaults: any size, half of the corners.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_chessboard_options_init(ptzcal_chessboard_options *options,
                                             size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a board: everything 0.
 *
 * @param board The struct.
 * @param size  sizeof *board.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_chessboard_init(ptzcal_chessboard *board, size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds a chessboard in an image.
 *
 * Corners that are hidden, outside the image or unlike a corner are left out: their entry of `found`
 * is 0, and so are their other numbers.
 *
 * @param image      The image; of colours their luma is used.
 * @param options    The options; may be NULL: any size.
 * @param board      Receives what was found; set up by ptzcal_chessboard_init.
 * @param corners    Receives columns x rows x 2 numbers: pixels x, y; (0, 0) is the centre of the
 *                   top-left pixel.
 * @param covariance Receives columns x rows x 3 numbers: xx, xy, yy, px^2, from the image's noise;
 *                   may be NULL.
 * @param found      Receives columns x rows numbers: 1 where the corner was found, else 0.
 * @param capacity   Number of corners that the arrays hold; 16384 is always enough.
 * @param needed     Receives columns x rows, also when the capacity is too small; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND; PTZCAL_STATUS_AMBIGUOUS for two whole boards
 *         whose squares look alike large (of others the one with the larger squares is taken);
 *         PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity, or when a plane's size cannot hold the
 *         image; PTZCAL_STATUS_INVALID_ARGUMENT for impossible sizes, a malformed image and one that is
 *         too small for the board; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_chessboard(const ptzcal_image *image,
                                       const ptzcal_chessboard_options *options,
                                       ptzcal_chessboard *board,
                                       double *corners,
                                       double *covariance,
                                       uint8_t *found,
                                       size_t capacity,
                                       size_t *needed,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Detecting SIFT features
 *
 * Keypoints of an image that are found again in other images of the same thing, and descriptors to
 * know them by: D. G. Lowe, Distinctive image features from scale-invariant keypoints, 2004. What is
 * found can be copied out, kept, and made features again later.
 * ============================================================================================= */

/**
 * Numbers of a keypoint: x, y, scale, angle, response, octave, sigma, elongation, direction.
 *
 * x and y: pixels; (0, 0) is the centre of the top-left pixel. scale: standard deviation of the
 * Gaussian at which it was found, pixels (half of OpenCV's size). angle: radians from x towards y.
 * response: |difference of Gaussians| of an image from 0 to 1. octave: -1 for the doubled image, 0 for
 * the image, 1 for half of it, and so on. sigma: standard deviation of x and of y, pixels, that is
 * typical of the scale (measured, not estimated for this keypoint). elongation: how much less sure the
 * place is along `direction` than across it, ratio of the standard deviations, 1 or more. direction:
 * radians from x towards y, -pi/2 to pi/2.
 */
#define PTZCAL_SIFT_KEYPOINT_SIZE 9

/** Bytes of a descriptor: 4 x 4 cells of 8 orientations, in OpenCV's order, of length 512. */
#define PTZCAL_SIFT_DESCRIPTOR_SIZE 128

/** Keypoints and descriptors of an image. */
typedef struct ptzcal_sift_features ptzcal_sift_features;

/** Which keypoints are looked for. */
typedef struct ptzcal_sift_options {
  /** Set by ptzcal_sift_options_init. */
  uint32_t struct_size;
  /** Most features; the strongest are kept. 0: all, up to 1048576. */
  uint32_t max_features;
  /**
   * 1: the image is doubled first, 0: it is not. Four times the time, for about three times the
   * keypoints.
   */
  uint32_t upsample;
  /** 0. */
  uint32_t reserved;
  /** Least contrast, above 0 to 1: Lowe's threshold times 3 intervals, as OpenCV counts. */
  double contrast_threshold;
  /** Greatest ratio of the principal curvatures, above 1: edges have a larger one. */
  double edge_ratio;
} ptzcal_sift_options;

/**
 * Sets up options with their defaults: all features, doubled image, contrast 0.04, edge ratio 10.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_options_init(ptzcal_sift_options *options,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds and describes the keypoints of an image, the strongest first. An image without contrast has
 * none.
 *
 * Memory: about 20 kB for each column of the image (5 kB when it is not doubled), and 0.2 kB a feature.
 *
 * @param image    The image, at least 12 pixels high and wide, at most 32768 wide, at most 268435456 in
 *                 all; of colours their luma is used.
 * @param options  The options; may be NULL: the defaults.
 * @param features Receives the features; free them with ptzcal_sift_features_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for options out of range, a malformed image
 *         and one that is too small or too large; PTZCAL_STATUS_BUFFER_TOO_SMALL when a plane's size
 *         cannot hold the image; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_sift(const ptzcal_image *image,
                                 const ptzcal_sift_options *options,
                                 ptzcal_sift_features **features,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes features of keypoints and descriptors that were kept elsewhere, or come from elsewhere.
 *
 * @param keypoints   n x 9 numbers, as ptzcal_sift_features_copy_keypoints writes them; sigma is ignored.
 *                    Of keypoints whose elongation is not known: 1.
 * @param descriptors n x 128 bytes.
 * @param n           Number of features, at most 1048576.
 * @param features    Receives the features; free them with ptzcal_sift_features_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for too many, for
 *         a scale that is not positive and for an elongation below 1 or above 1000.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_features_new(const double *keypoints,
                                       const uint8_t *descriptors,
                                       size_t n,
                                       ptzcal_sift_features **features,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees features.
 *
 * @param features The features; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_sift_features_free(ptzcal_sift_features *features) PTZCAL_NOEXCEPT;

/**
 * How many features there are.
 *
 * @param features The features.
 * @param count    Receives the number.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_features_count(const ptzcal_sift_features *features,
                                         size_t *count,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the keypoints, PTZCAL_SIFT_KEYPOINT_SIZE numbers each.
 *
 * @param features  The features.
 * @param keypoints Receives x, y, scale, angle, response, octave, sigma of each; may be NULL when
 *                  capacity is 0.
 * @param capacity  Numbers that fit.
 * @param needed    Receives how many numbers there are; may be NULL.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_features_copy_keypoints(const ptzcal_sift_features *features,
                                                  double *keypoints,
                                                  size_t capacity,
                                                  size_t *needed,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the descriptors, PTZCAL_SIFT_DESCRIPTOR_SIZE bytes each.
 *
 * @param features    The features.
 * @param descriptors Receives the descriptors; may be NULL when capacity is 0.
 * @param capacity    Bytes that fit.
 * @param needed      Receives how many bytes there are; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_features_copy_descriptors(const ptzcal_sift_features *features,
                                                    uint8_t *descriptors,
                                                    size_t capacity,
                                                    size_t *needed,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Matching SIFT features
 *
 * Pairs of features of two images whose descriptors are each other's nearest, and much nearer than the
 * next (Lowe's ratio test). The search is exact.
 * ============================================================================================= */

/** Which pairs of features are matches. */
typedef struct ptzcal_sift_match_options {
  /** Set by ptzcal_sift_match_options_init. */
  uint32_t struct_size;
  /** 1: each must be the nearest of the other, 0: that of the second image the nearest of the first's. */
  uint32_t mutual;
  /** Greatest ratio of the distances to the nearest and to the second nearest, above 0 to 1; 1: any. */
  double max_ratio;
} ptzcal_sift_match_options;

/**
 * Sets up options with their defaults: a ratio of 0.8, each other's nearest.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sift_match_options_init(ptzcal_sift_match_options *options,
                                             size_t size) PTZCAL_NOEXCEPT;

/**
 * Matches the features of two images. A feature of `a` has at most one match; without the mutual check
 * one of `b` can have several.
 *
 * @param a         Features of the first image.
 * @param b         Features of the second image.
 * @param options   The options; may be NULL: the defaults.
 * @param pairs     Receives 2 numbers a match, by ascending feature of `a`: the features' indices in `a`
 *                  and `b`.
 * @param distances Receives 2 numbers a match: the distance (of descriptors of length 512), and its ratio
 *                  to the distance of the second nearest (1 where there is none); may be NULL.
 * @param capacity  Number of matches that the arrays hold; the number of features of `a` is always enough.
 * @param count     Receives the number of matches, also when the capacity is too small.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: no match was written;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for options out of range and for more than 2^36 pairs of
 *         features; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_match_sift(const ptzcal_sift_features *a,
                                const ptzcal_sift_features *b,
                                const ptzcal_sift_match_options *options,
                                uint32_t *pairs,
                                double *distances,
                                size_t capacity,
                                size_t *count,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Detecting edges and straight lines
 *
 * Edges are pixels where the light changes fastest (Canny), to a fraction of a pixel. Line segments are
 * straight edges, to a few hundredths of a pixel, each with its covariance: what
 * ptzcal_correspondences_add_lines takes as `uv` and `uv_covariance`.
 *
 * A segment's `uv` are two points on it whose errors across it are independent, one radius of gyration
 * from its middle. Together they say all that is known of the line; on a line that a lens bends evenly
 * they still lie on it, which its ends do not. On the way from the first to the second the bright side
 * is on the right.
 * ============================================================================================= */

/** Which line segments are looked for. */
typedef struct ptzcal_line_options {
  /** Set by ptzcal_line_options_init. */
  uint32_t struct_size;
  /** Most segments that are returned, the longest first: 1 or more; the default is 10000. */
  uint32_t max_segments;
  /** Least length, pixels: 8 or more; the default is 20. */
  double min_length;
  /**
   * Least step from dark to bright, grey levels: above 0 to 255; the default is 12. Where the image's
   * noise asks for more, more is demanded.
   */
  double min_contrast;
  /**
   * Longest gap between two pieces of one line that are joined, pixels; the default is 40. It is never
   * longer than the shorter piece. 0: nothing is joined.
   */
  double max_gap;
} ptzcal_line_options;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_line_options_init(ptzcal_line_options *options,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds edges: Canny's maxima of the gradient, row by row.
 *
 * @param image    The image; of colours their luma is used.
 * @param sigma    Standard deviation of the Gaussian that smooths the image first, pixels, at most 10;
 *                 0: a 3 x 3 binomial filter (0.71 pixels), which is faster.
 * @param low      Gradient from which on an edge goes on, grey levels per pixel of the smoothed image,
 *                 above 0.
 * @param high     Gradient that an edge must reach somewhere, `low` or more.
 * @param edges    Receives 5 numbers an edge pixel: x and y, pixels; the unit vector across the edge
 *                 towards its bright side, x and y; the gradient.
 * @param capacity Number of edge pixels that the array holds.
 * @param count    Receives their number, also when the capacity is too small.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity (nothing was written), or
 *         when a plane's size cannot hold the image; PTZCAL_STATUS_INVALID_ARGUMENT for impossible
 *         numbers, a malformed image and one of more than 2^28 pixels; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_edges(const ptzcal_image *image,
                                  double sigma,
                                  double low,
                                  double high,
                                  double *edges,
                                  size_t capacity,
                                  size_t *count,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds straight line segments, the longest first. In an image of nothing but white noise there is
 * about one at most.
 *
 * A line that a lens bends is one segment while it leaves a straight line by a pixel or so, and several
 * otherwise. What is needed besides the image is a byte a pixel.
 *
 * @param image         The image; of colours their luma is used.
 * @param options       The options; may be NULL: the defaults.
 * @param uv            Receives n x 4 numbers: two points of each line with independent errors, pixels.
 * @param uv_covariance Receives n x 6 numbers: xx, xy, yy of each point, px^2: that across the line, in
 *                      all directions; may be NULL.
 * @param ends          Receives n x 4 numbers: from where to where the line is seen, pixels, to a pixel or
 *                      two; may be NULL.
 * @param details       Receives n x 3 numbers: the step from dark to bright, grey levels; standard
 *                      deviation of the edge's blur, pixels; length less gaps, pixels; may be NULL.
 * @param capacity      Number of segments that the arrays hold; the options' max_segments is always
 *                      enough.
 * @param count         Receives the number n of segments, also when the capacity is too small.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL for the capacity (nothing was written), or
 *         when a plane's size cannot hold the image; PTZCAL_STATUS_INVALID_ARGUMENT for options out of
 *         range, a malformed image and one of more than 2^28 pixels; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_detect_line_segments(const ptzcal_image *image,
                                          const ptzcal_line_options *options,
                                          double *uv,
                                          double *uv_covariance,
                                          double *ends,
                                          double *details,
                                          size_t capacity,
                                          size_t *count,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Lines in space
 *
 * Straight lines through points of a cloud, or where an image with depths shows line segments, and which
 * of them is which segment of a camera's image.
 * Lines have the form that ptzcal_correspondences_add_directed_lines takes.
 * ============================================================================================= */

/** How a line is fitted to points. */
typedef struct ptzcal_line_fit_options {
  /** Set by ptzcal_line_fit_options_init. */
  uint32_t struct_size;
  /** 1 (the default): outliers are found and set aside, from five points on. 0: all points are used. */
  uint32_t robust;
  /** Seed of the search for outliers; the default is 1. */
  uint64_t seed;
  /** Standard deviation of every coordinate of points without covariance, metres; the default is 0.01. */
  double sigma;
  /** Outliers lie beyond this many standard deviations; the default is 3.7. */
  double outlier_threshold;
  /** Least share of the points that must agree, 0 to 1; the default is 0.3. */
  double min_inliers;
} ptzcal_line_fit_options;

/** Which line in space is which segment. */
typedef struct ptzcal_line_match_options {
  /** Set by ptzcal_line_match_options_init. */
  uint32_t struct_size;
  /**
   * 1 (the default): the bright side must be on the same hand. Both cameras must then see the same
   * surfaces on both sides of a line, and directions of lines in space be those of segments that they
   * were made from. 0: either.
   */
  uint32_t same_polarity;
  /** Standard deviation of the camera's projections, pixels; the default is 2. */
  double camera_sigma;
  /** Greatest distance of segment and line, in standard deviations; the default is 3. */
  double max_distance;
  /**
   * By how much the next candidate's squared distance, in standard deviations, must be greater; the
   * default is 9.
   */
  double min_lead;
  /**
   * Least share of the shorter one that segment and line's image have in common, 0 to 1; the default is
   * 0.5.
   */
  double min_overlap;
} ptzcal_line_match_options;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_line_fit_options_init(ptzcal_line_fit_options *options,
                                           size_t size) PTZCAL_NOEXCEPT;

/**
 * Fits a straight line to points in space, of which some may be of other things: consensus of minimal
 * samples (RANSAC), then maximum likelihood. Of several lines the one that most points agree with is
 * taken. Points of a depth image need their covariances: along the ray their errors grow with the square
 * of the depth. Pixels without depth must be left out.
 *
 * @param xyz             n x 3 numbers: points, metres.
 * @param xyz_covariance  n x 9 numbers: of each point, row-major, positive definite, m^2; may be NULL: the
 *                        options' sigma.
 * @param n               Number of points, 2 or more.
 * @param options         The options; may be NULL: the defaults.
 * @param point_direction Receives 6 numbers: a point of the line in the middle of the inliers, and its
 *                        unit direction.
 * @param line_covariance Receives 36 numbers: of point and direction together, row-major; may be NULL.
 *                        Larger than the stated noise makes it where the residuals contradict that
 *                        (1 in 1000).
 * @param extent          Receives 2 numbers: the first and last inlier's distance from the point along the
 *                        direction, metres; may be NULL.
 * @param inliers         Receives n numbers: 1 for points that agree, else 0; may be NULL.
 * @param noise_factor    Receives the root of chi-square over its degrees of freedom, about 1 where the
 *                        noise is as stated; 0 without redundancy; may be NULL.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS;
 *         PTZCAL_STATUS_DEGENERATE for points that are in one place as far as their noise tells;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none and options out of range;
 *         PTZCAL_STATUS_NOT_FINITE (index: the point).
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_fit_line_3d(const double *xyz,
                                 const double *xyz_covariance,
                                 size_t n,
                                 const ptzcal_line_fit_options *options,
                                 double *point_direction,
                                 double *line_covariance,
                                 double *extent,
                                 uint8_t *inliers,
                                 double *noise_factor,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds where line segments of an image with depths lie in space: where the surfaces beside them meet
 * their viewing planes. Where the depth differs from side to side, the line is the edge of what is in
 * front; it is taken to be an edge of the thing itself, not the outline of a round one.
 *
 * @param uv              n x 4 numbers: two points of each segment with independent errors, pixels, as
 *                        ptzcal_detect_line_segments gives them.
 * @param uv_covariance   n x 6 numbers: xx, xy, yy of each point, px^2; may be NULL: 1 px, uncorrelated.
 * @param ends            n x 4 numbers: from where to where each segment is seen, pixels.
 * @param n               Number of segments.
 * @param camera          The camera of the image and of the depths. Its pose gives the frame of the lines.
 * @param map             The depths, of the camera's image size.
 * @param inverse_depth_sigma Standard deviation of the inverse depths, 1 / metre: 0.0014 for a Kinect.
 * @param depth_sigma     Standard deviation of the depths besides, metres; not 0 with the other.
 * @param point_direction Receives n x 6 numbers: a point of each line, metres, and its unit direction, that
 *                        of its segment; 0 where there is none.
 * @param line_covariance Receives n x 36 numbers: of point and direction, row-major; may be NULL.
 * @param extents         Receives n x 2 numbers: from where to where each line is seen: distances from its
 *                        point along its direction, metres; may be NULL.
 * @param found           Receives n numbers: 1 for a line, 0 where depths are missing on either side or
 *                        contradict each other.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for segments without length, a camera or noise
 *         that are none, and a map of another size; PTZCAL_STATUS_NOT_FINITE (index: the segment).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_lift_line_segments(const double *uv,
                                        const double *uv_covariance,
                                        const double *ends,
                                        size_t n,
                                        const ptzcal_camera *camera,
                                        const ptzcal_depth_map *map,
                                        double inverse_depth_sigma,
                                        double depth_sigma,
                                        double *point_direction,
                                        double *line_covariance,
                                        double *extents,
                                        uint8_t *found,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_line_match_options_init(ptzcal_line_match_options *options,
                                             size_t size) PTZCAL_NOEXCEPT;

/**
 * Matches lines in space with the segments of a camera's image, by a first estimate of the camera. A line
 * and a segment are matched once at most. What is not certain is not matched: lines with a second
 * candidate nearly as good have none (but of pieces of one line the longest is taken).
 *
 * @param point_direction n_lines x 6 numbers: a point of each line, metres, world frame, and its
 *                        direction, of any length but zero.
 * @param line_covariance n_lines x 36 numbers: of point and direction, row-major; may be NULL: the lines
 *                        are exact.
 * @param extents         n_lines x 2 numbers: from where to where each line was seen: multiples of its
 *                        direction from its point.
 * @param n_lines         Number of lines.
 * @param camera          The camera.
 * @param uv              n_segments x 4 numbers: two points of each segment with independent errors,
 *                        pixels, as ptzcal_detect_line_segments gives them.
 * @param uv_covariance   n_segments x 6 numbers: xx, xy, yy of each point, px^2; may be NULL: 1 px,
 *                        uncorrelated. Only what it says across the segment counts.
 * @param ends            n_segments x 4 numbers: from where to where each segment is seen, pixels.
 * @param n_segments      Number of segments.
 * @param options         The options; may be NULL: the defaults.
 * @param pairs           Receives 2 numbers a match, by ascending line: the indices of line and segment.
 * @param residuals       Receives 2 numbers a match: distances of the segment's points from the line's
 *                        image, pixels; may be NULL.
 * @param capacity        Number of matches that the arrays hold; n_lines is always enough.
 * @param count           Receives the number of matches, also when the capacity is too small.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: no match was written;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for directions that are zero, segments without length, and
 *         options or a camera that are none; PTZCAL_STATUS_NOT_FINITE (index: the line or segment).
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_match_lines(const double *point_direction,
                                 const double *line_covariance,
                                 const double *extents,
                                 size_t n_lines,
                                 const ptzcal_camera *camera,
                                 const double *uv,
                                 const double *uv_covariance,
                                 const double *ends,
                                 size_t n_segments,
                                 const ptzcal_line_match_options *options,
                                 uint32_t *pairs,
                                 double *residuals,
                                 size_t capacity,
                                 size_t *count,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * 2D-3D measurements
 *
 * What a camera is calibrated from: a growing set of measurements of one camera, in any mixture of
 * points whose position is known, points with covariances, laser shots of a rig, and straight lines.
 * Each function that adds does it for all its measurements or for none. Indices count from 0 in the order of
 * adding, and the results of a calibration keep that order. A set takes 10,000,000 measurements at most.
 * ============================================================================================= */

/** 2D-3D measurements of one camera. */
typedef struct ptzcal_correspondences ptzcal_correspondences;

/**
 * Makes an empty set for a camera with the given image size.
 *
 * @param image_width  Pixels, 1 to 65536.
 * @param image_height Pixels, 1 to 65536.
 * @param set          Receives the set; free it with ptzcal_correspondences_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_new(uint32_t image_width,
                                         uint32_t image_height,
                                         ptzcal_correspondences **set,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a set. Calibrations made from it live on.
 *
 * @param set The set; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_correspondences_free(ptzcal_correspondences *set) PTZCAL_NOEXCEPT;

/**
 * Adds points whose 3D position is exact (surveyed, or far better known than a pixel).
 *
 * @param set   The set.
 * @param xyz   n x 3 numbers: points, metres, world frame.
 * @param uv    n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
 * @param n     Number of points.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for more than a set takes; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_points(ptzcal_correspondences *set,
                                                const double *xyz,
                                                const double *uv,
                                                size_t n,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds points with the covariances of their 3D positions, of their pixels, or of both.
 *
 * @param set            The set.
 * @param xyz            n x 3 numbers: points, metres, world frame.
 * @param xyz_covariance n x 9 numbers: of each point, row-major, symmetric, positive semi-definite,
 *                       m^2; may be NULL: the points are exact.
 * @param uv             n x 2 numbers: their pixels.
 * @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be
 *                       NULL: the calibration's pixel noise.
 * @param n              Number of points.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_points_weighted(ptzcal_correspondences *set,
                                                         const double *xyz,
                                                         const double *xyz_covariance,
                                                         const double *uv,
                                                         const double *uv_covariance,
                                                         size_t n,
                                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds laser shots: what the rig's head read and saw, and where this camera saw the spot. The
 * solver then knows each point by its ray and its inverse depth, whose noise, unlike that of the
 * depth, is Gaussian; this is what makes the calibration as good as the shots are.
 *
 * @param set             The set. Its world becomes the rig's.
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param uv              n x 2 numbers: the spot's pixel in the camera to be calibrated.
 * @param uv_covariance   n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the shot, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a spot outside the rig's lens model or a covariance
 *         that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_laser_shots(ptzcal_correspondences *set,
                                                     const ptzcal_rig_model *model,
                                                     const double *pan_tilt,
                                                     const double *spots,
                                                     const double *spot_covariance,
                                                     const double *uv,
                                                     const double *uv_covariance,
                                                     size_t n,
                                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds straight lines by two points of each in space, exact or with covariances. The ends of a segment
 * are images of no particular points of its line: how long the segment is, and how far apart the two
 * points, does not matter beyond their noise. A line is worth a point: two equations. Its residual in
 * ptzcal_calibration_copy_residuals are the distances of its two ends from the line's image, which a
 * distorting lens bends.
 *
 * @param set            The set.
 * @param xyz            n x 6 numbers: two points of each line, metres, world frame.
 * @param xyz_covariance n x 18 numbers: of the two points of each line, row-major, positive
 *                       semi-definite, m^2; may be NULL: the lines are exact.
 * @param uv             n x 4 numbers: the two ends of each line's segment in the image, pixels.
 * @param uv_covariance  n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be NULL:
 *                       the calibration's pixel noise.
 * @param n              Number of lines.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the line, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for two points or two ends that are one, or a covariance
 *         that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_lines(ptzcal_correspondences *set,
                                               const double *xyz,
                                               const double *xyz_covariance,
                                               const double *uv,
                                               const double *uv_covariance,
                                               size_t n,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds straight lines like ptzcal_correspondences_add_lines, each by a point and a direction, as a fit
 * of a line to a cloud gives them.
 *
 * @param set             The set.
 * @param point_direction n x 6 numbers: a point of each line, metres, world frame, and its direction,
 *                        of any length but zero.
 * @param line_covariance n x 36 numbers: of point and direction together, 6 x 6 row-major, positive
 *                        semi-definite; may be NULL: the lines are exact.
 * @param uv              n x 4 numbers: the two ends of each line's segment in the image, pixels.
 * @param uv_covariance   n x 6 numbers: xx, xy, yy of each end, positive definite, px^2; may be NULL:
 *                        the calibration's pixel noise.
 * @param n               Number of lines.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the line, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a direction that is zero, two ends that are one, or a
 *         covariance that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_directed_lines(ptzcal_correspondences *set,
                                                        const double *point_direction,
                                                        const double *line_covariance,
                                                        const double *uv,
                                                        const double *uv_covariance,
                                                        size_t n,
                                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many measurements there are.
 *
 * @param set   The set.
 * @param count Receives the number.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_count(const ptzcal_correspondences *set,
                                           size_t *count,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * How a camera is calibrated
 *
 * Options for ptzcal_calibrate_camera. Without any the defaults are used, which are right for laser
 * shots and surveyed points.
 * ============================================================================================= */

/** How a camera is calibrated. */
typedef struct ptzcal_calibration_options ptzcal_calibration_options;

/**
 * Makes options with their defaults, which are right for laser shots and surveyed points: no
 * distortion, hardly any skew, nearly square pixels, outliers set aside, seed 1.
 *
 * @param options Receives the options; free them with ptzcal_calibration_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_new(ptzcal_calibration_options **options,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_calibration_options_free(ptzcal_calibration_options *options) PTZCAL_NOEXCEPT;

/**
 * Sets the lens model that is fitted. Each coefficient wants points towards the image's corners.
 *
 * @param options The options.
 * @param model   A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_NONE.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_distortion(ptzcal_calibration_options *options,
                                                        uint32_t model,
                                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Keeps a known lens, so that only the pose is found: the points may then lie in a plane.
 *
 * @param options The options.
 * @param camera  A camera whose intrinsics and distortion are kept (its pose is ignored); may be
 *                NULL: the lens is found, which is the default.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_lens(ptzcal_calibration_options *options,
                                                  const ptzcal_camera *camera,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how much the pixels' axes may lean: the prior standard deviation of skew / f about 0.
 *
 * @param options The options.
 * @param sigma   0 forces no skew; INFINITY leaves it to the data; the default is 0.001.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_skew_sigma(ptzcal_calibration_options *options,
                                                        double sigma,
                                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how far pixels may be from square: the prior standard deviation of fx / fy about 1.
 *
 * @param options The options.
 * @param sigma   0 forces fx = fy; INFINITY leaves it to the data; the default is 0.001.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_aspect_sigma(ptzcal_calibration_options *options,
                                                          double sigma,
                                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the noise of pixels that were added without a covariance.
 *
 * @param options The options.
 * @param sigma   Standard deviation of each coordinate, pixels; 0 (the default): estimated from the
 *                residuals.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_pixel_sigma(ptzcal_calibration_options *options,
                                                         double sigma,
                                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Chooses whether gross outliers are searched and set aside.
 *
 * @param options The options.
 * @param robust  0: every measurement is used; anything else (the default): outliers are set aside.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_robust(ptzcal_calibration_options *options,
                                                    int32_t robust,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the seed of the search for outliers. The same seed gives the same result, bit for bit, on
 * the same machine.
 *
 * @param options The options.
 * @param seed    Any number; the default is 1.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_seed(ptzcal_calibration_options *options,
                                                  uint64_t seed,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how uncertain the focal length may be: above it the calibration is refused
 * (PTZCAL_STATUS_DEGENERATE) rather than returned.
 *
 * @param options  The options.
 * @param relative Standard deviation over focal length, positive; the default is 0.1; INFINITY
 *                 returns whatever was found.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_max_focal_deviation(ptzcal_calibration_options *options,
                                                                 double relative,
                                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how many iterations a refinement may take before it is PTZCAL_STATUS_NO_CONVERGENCE.
 *
 * @param options    The options.
 * @param iterations 1 to 10000; the default is 100.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_max_iterations(ptzcal_calibration_options *options,
                                                            uint32_t iterations,
                                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the token that stops the calibration.
 *
 * @param options The options.
 * @param token   The token; may be NULL: none (the default). It may be freed before the options.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_options_set_cancel(ptzcal_calibration_options *options,
                                                    const ptzcal_cancel *token,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Calibrating a camera
 *
 * One solver for every mixture of measurements: ptzcal_calibrate_camera finds intrinsics, lens and
 * pose with their covariance, sets gross outliers aside, and refuses sets that cannot determine the
 * answer, with a hint that says what to add. The same input and seed give the same result.
 * ============================================================================================= */

/**
 * A calibrated camera with all that says how good it is. Immutable: any number of threads may read
 * it.
 */
typedef struct ptzcal_calibration ptzcal_calibration;

/** What a calibration says about itself. */
typedef struct ptzcal_calibration_summary {
  /** Set by ptzcal_calibration_summary_init. */
  uint32_t struct_size;
  /** Iterations of the last refinement. */
  uint32_t iterations;
  /** Measurements given. */
  uint64_t measurements;
  /** Measurements used; the others are outliers. */
  uint64_t inliers;
  /** Parameters: the side of the covariance matrix. */
  uint64_t parameters;
  /** Root mean square length of the inliers' residuals, pixels. */
  double rms;
  /** Noise that the residuals show over noise that was assumed: 1 when the covariances were right. */
  double noise_factor;
  /** Condition number of the normal equations, scaled to unit diagonal; 1 is perfect. */
  double condition;
  /** Sum of squared residuals, each over its stated standard deviation, priors included. */
  double chi2;
  /** Its degrees of freedom. */
  uint64_t degrees_of_freedom;
  /**
   * Chance of such residuals or larger ones when model and stated noise are right. Below 0.001 the
   * model does not fit. Means nothing where the noise was estimated from the residuals.
   */
  double probability;
  /** How many warnings there are: see ptzcal_calibration_warning. */
  uint64_t warnings;
} ptzcal_calibration_summary;

/**
 * Calibrates a camera from 2D-3D measurements. The set is in use until the call returns: other
 * threads may read it, but adding to it is PTZCAL_STATUS_BUSY. The calibration keeps a copy of both,
 * which ptzcal_calibration_save writes.
 *
 * @param set     The measurements.
 * @param options The options; may be NULL: the defaults.
 * @param result  Receives the calibration; free it with ptzcal_calibration_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (the hint says
 *         what to add); PTZCAL_STATUS_NO_CONSENSUS; PTZCAL_STATUS_NO_CONVERGENCE;
 *         PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibrate_camera(const ptzcal_correspondences *set,
                                      const ptzcal_calibration_options *options,
                                      ptzcal_calibration **result,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a calibration.
 *
 * @param calibration The calibration; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_calibration_free(ptzcal_calibration *calibration) PTZCAL_NOEXCEPT;

/**
 * The calibrated camera.
 *
 * @param calibration The calibration.
 * @param camera      Receives the camera; set up by ptzcal_camera_init.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_get_camera(const ptzcal_calibration *calibration,
                                            ptzcal_camera *camera,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_summary_init(ptzcal_calibration_summary *summary,
                                              size_t size) PTZCAL_NOEXCEPT;

/**
 * What the calibration says about itself.
 *
 * @param calibration The calibration.
 * @param summary     Receives the summary; set up by ptzcal_calibration_summary_init.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_get_summary(const ptzcal_calibration *calibration,
                                             ptzcal_calibration_summary *summary,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
 * `parameters`. Their order:
 *   0 fx, 1 fy, 2 skew, 3 cx, 4 cy (pixels),
 *   5 ... the coefficients of the camera's lens model, in its order (0, 1, 4 or 5 of them),
 *   then 3 for the rotation: w in R <- exp([w]x) R, a turn about the camera's own axes (radians),
 *   then 3 for the camera's centre in the world (metres).
 * Rows and columns of parameters that were not free are 0.
 *
 * @param calibration The calibration.
 * @param buffer      Receives the numbers; may be NULL when capacity is 0.
 * @param capacity    How many numbers the buffer holds.
 * @param needed      Receives how many there are, also when they do not fit; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_copy_covariance(const ptzcal_calibration *calibration,
                                                 double *buffer,
                                                 size_t capacity,
                                                 size_t *needed,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Measured minus predicted pixel of every measurement, outliers included: n x 2 numbers, n = the
 * summary's `measurements`, in the order of adding. Of a line they are the signed distances of its
 * segment's two ends from the line's image, positive to the right of it as seen from the first end to
 * the second. Infinite for an outlier that the camera cannot see (behind it).
 *
 * @param calibration The calibration.
 * @param buffer      Receives the numbers; may be NULL when capacity is 0.
 * @param capacity    How many numbers the buffer holds.
 * @param needed      Receives how many there are, also when they do not fit; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_copy_residuals(const ptzcal_calibration *calibration,
                                                double *buffer,
                                                size_t capacity,
                                                size_t *needed,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Which measurements were used: n bytes, n = the summary's `measurements`, in the order of adding;
 * 1 for an inlier, 0 for an outlier.
 *
 * @param calibration The calibration.
 * @param buffer      Receives the bytes; may be NULL when capacity is 0.
 * @param capacity    How many bytes the buffer holds.
 * @param needed      Receives how many there are, also when they do not fit; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_copy_inliers(const ptzcal_calibration *calibration,
                                              uint8_t *buffer,
                                              size_t capacity,
                                              size_t *needed,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Calibrating a camera: does it fit?
 *
 * A chi-square test of the residuals (`probability` of the summary), a score test of what was kept
 * fixed, and what the data determine worst, in words for a person.
 * ============================================================================================= */

/**
 * What a person should know of the calibration, one line of English UTF-8: residuals beyond the stated
 * noise, a lens or skew that was kept fixed and should not be. The wording may change in any version;
 * decide by the number of warnings and by the summary's `probability`.
 *
 * @param calibration The calibration; may be NULL.
 * @param index       From 0 to the summary's `warnings` less 1.
 * @return A string that lives as long as the calibration; "" when there is no such warning; never
 *         NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_calibration_warning(const ptzcal_calibration *calibration,
                                       size_t index) PTZCAL_NOEXCEPT;

/**
 * What the data determine worst, and what to add, one line of English UTF-8, such as "weakest: camera
 * focal length against camera position: add shots much nearer or farther".
 *
 * @param calibration The calibration; may be NULL.
 * @return A string that lives as long as the calibration; "" for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_calibration_weakest(const ptzcal_calibration *calibration) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Projection with uncertainty
 *
 * What the covariance of a calibration means for its use: pixels of points, viewing rays of pixels,
 * and points on a plane under pixels (the floor under a click), each with its covariance, to first
 * order. Each function takes n of them; outputs are written for all of them or for none.
 * ============================================================================================= */

/**
 * The pixels of world points and their covariances.
 *
 * @param calibration    The calibration.
 * @param xyz            n x 3 numbers: points, metres, world frame.
 * @param xyz_covariance n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
 *                       NULL: the points are exact.
 * @param n              Number of points.
 * @param uv             Receives n x 2 numbers: pixels.
 * @param uv_covariance  Receives n x 3 numbers: xx, xy, yy of each pixel, px^2; may be NULL. The
 *                       camera's uncertainty and the point's; not the noise of a measured pixel.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA, PTZCAL_STATUS_OUTSIDE_LENS,
 *         PTZCAL_STATUS_NOT_FINITE (index: the point); PTZCAL_STATUS_INVALID_ARGUMENT for a
 *         covariance that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_project(const ptzcal_calibration *calibration,
                                         const double *xyz,
                                         const double *xyz_covariance,
                                         size_t n,
                                         double *uv,
                                         double *uv_covariance,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The viewing rays of pixels, from the camera's centre (ptzcal_camera_centre), and their
 * covariances.
 *
 * @param calibration    The calibration.
 * @param uv             n x 2 numbers: pixels.
 * @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
 *                       NULL: the pixels are exact.
 * @param n              Number of pixels.
 * @param directions     Receives n x 3 numbers: unit vectors in the world frame.
 * @param ray_covariance Receives n x 36 numbers: of the centre (metres) and the direction, in that
 *                       order, 6 x 6 row-major; may be NULL. The centre is the same for all pixels:
 *                       so is its part.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel that no ray reaches
 *         through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_back_project(const ptzcal_calibration *calibration,
                                              const double *uv,
                                              const double *uv_covariance,
                                              size_t n,
                                              double *directions,
                                              double *ray_covariance,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The points of a plane under pixels, and their covariances: where on the floor is what was clicked
 * on?
 *
 * @param calibration    The calibration.
 * @param uv             n x 2 numbers: pixels.
 * @param uv_covariance  n x 3 numbers: xx, xy, yy of each pixel, positive semi-definite, px^2; may be
 *                       NULL: the pixels are exact.
 * @param n              Number of pixels.
 * @param normal         3 numbers: the plane's normal in the world frame, of any length but zero.
 * @param distance       The plane is normal . x = distance (metres, for a normal of unit length).
 * @param xyz            Receives n x 3 numbers: points, metres, world frame.
 * @param xyz_covariance Receives n x 9 numbers: of each point, row-major, m^2; may be NULL. The plane
 *                       is exact: across it nothing varies.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BEHIND_CAMERA (index: the first pixel whose ray does not
 *         meet the plane in front of the camera); PTZCAL_STATUS_OUTSIDE_LENS (index: the first pixel
 *         that no ray reaches through the lens model); PTZCAL_STATUS_NOT_FINITE (index: the pixel);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a normal or covariance that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_back_project_to_plane(const ptzcal_calibration *calibration,
                                                       const double *uv,
                                                       const double *uv_covariance,
                                                       size_t n,
                                                       const double *normal,
                                                       double distance,
                                                       double *xyz,
                                                       double *xyz_covariance,
                                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Closed forms with lens distortion
 *
 * The two linear methods with the division model, by their names. Both take every measurement as it
 * is (no outliers are set aside) and the centre of distortion as given; ptzcal_calibrate_camera begins
 * with the first one where a lens is fitted, and finds the centre, which is the principal point, too.
 * ============================================================================================= */

/**
 * Radial alignment (Tsai 1987) with the division model: a camera with a radial lens in two linear
 * steps, from at least 7 measurements. Its lambda is within about a fifth of the best possible
 * accuracy, and it works without distortion too.
 *
 * @param set    The measurements, free of outliers; not in one plane.
 * @param centre 2 numbers: the centre of distortion, pixels; may be NULL: the image's centre.
 * @param camera Receives the camera, with a lens PTZCAL_DISTORTION_MODEL_DIVISION about its principal
 *               point; set up by ptzcal_camera_init. Lambda in pixels^-2 is
 *               distortion[0] / (fx fy).
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_radial_alignment(const ptzcal_correspondences *set,
                                      const double *centre,
                                      ptzcal_camera *camera,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The direct linear transform with the division model as a generalised eigenproblem (Fitzgibbon
 * 2001), from at least 6 measurements. The weaker method: lambda is off by about sigma^2 / lambda
 * however many measurements there are, and a lens without distortion is refused or answered with a
 * lambda that means nothing. Use ptzcal_radial_alignment.
 *
 * @param set    The measurements, free of outliers; their own errors in space are not used.
 * @param centre 2 numbers: the centre of distortion, pixels; may be NULL: the image's centre.
 * @param camera Receives the camera, with a lens PTZCAL_DISTORTION_MODEL_DIVISION about its principal
 *               point; set up by ptzcal_camera_init. Lambda in pixels^-2 is
 *               distortion[0] / (fx fy).
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (no eigenvalue is
 *         real, is a lens, or puts all points in front of the camera);
 *         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_division_eigenproblem(const ptzcal_correspondences *set,
                                           const double *centre,
                                           ptzcal_camera *camera,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Views of boards
 *
 * A camera by itself is calibrated from views of a planar board with corners at known places, such
 * as a chessboard, held in different ways: three views or more, tilted by 20 to 40 degrees this way
 * and that, over the whole image, near and far. Corners may be missing, boards may differ. With the
 * laser on, the same views calibrate the laser's line (ptzcal_calibrate_laser_line). Views are
 * numbered from 0 in the order of adding.
 * ============================================================================================= */

/** A camera calibrated from boards. Immutable: any number of threads may read it. */
typedef struct ptzcal_board_calibration ptzcal_board_calibration;

/** Views of boards by one camera. */
typedef struct ptzcal_boards ptzcal_boards;

/** What was found about one view of a board. */
typedef struct ptzcal_board_view {
  /** Set by ptzcal_board_view_init. */
  uint32_t struct_size;
  /**
   * 0 for a view that was set aside because most of its corners disagree with the other views: its
   * pose is then the best that could be had, and its covariance 0.
   */
  uint32_t used;
  /** Corners given. */
  uint64_t corners;
  /** Corners used; the others are outliers. */
  uint64_t inliers;
  /**
   * Root mean square length of the used corners' residuals, pixels; of all corners of a view that
   * was set aside.
   */
  double rms;
  /** R, row-major: board axes to camera axes. */
  double rotation[9];
  /** t: the board's origin in the camera frame, in the board's unit. */
  double translation[3];
  /**
   * 6 x 6, row-major: of w in R <- exp([w]x) R, a turn about the camera's axes (radians), then of
   * the camera's centre in the board's frame (the board's unit).
   */
  double covariance[36];
} ptzcal_board_view;

/**
 * Makes an empty set of views for a camera with the given image size.
 *
 * @param image_width  Pixels, 1 to 65536.
 * @param image_height Pixels, 1 to 65536.
 * @param boards       Receives the set; free it with ptzcal_boards_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_boards_new(uint32_t image_width,
                                uint32_t image_height,
                                ptzcal_boards **boards,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a set of views. Calibrations made from it live on.
 *
 * @param boards The set; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_boards_free(ptzcal_boards *boards) PTZCAL_NOEXCEPT;

/**
 * Adds the corners of a board that one image shows.
 *
 * @param boards        The set.
 * @param board_xy      n x 2 numbers: places on the board, in any unit (metres for a laser line), the same
 *                      for all boards; all boards must show the same side of their x and y axes.
 * @param uv            n x 2 numbers: their pixels; (0, 0) is the centre of the top-left pixel.
 * @param uv_covariance n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be NULL: the
 *                      common noise that the options state, or that the residuals show.
 * @param n             Number of corners, 4 or more.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the
 *         corner); PTZCAL_STATUS_DEGENERATE (all corners, or all but one, on one line);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_boards_add_view(ptzcal_boards *boards,
                                     const double *board_xy,
                                     const double *uv,
                                     const double *uv_covariance,
                                     size_t n,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the laser's spot on the board of a view was seen; a later one replaces it.
 *
 * @param boards        The set.
 * @param view          The view.
 * @param uv            2 numbers: the spot's pixel.
 * @param uv_covariance 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: the common noise of
 *                      the corners.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view, or a covariance that is none);
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_boards_set_spot(ptzcal_boards *boards,
                                     uint32_t view,
                                     const double *uv,
                                     const double *uv_covariance,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Lets the board be a smoothly bent sheet, z = b1 x^2 + b2 x y + b3 y^2 with x and y from the middle of
 * all corners, in units of the greatest distance from there. All views must then be of one board.
 *
 * @param boards The set.
 * @param sigma  Prior standard deviation of each b, in the board's unit; 0, the default: boards are flat.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_boards_set_bending(ptzcal_boards *boards,
                                        double sigma,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many views there are.
 *
 * @param boards The set.
 * @param count  Receives the number.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_boards_count(const ptzcal_boards *boards,
                                  size_t *count,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Calibrates a camera from views of boards. With a lens that the options keep
 * (ptzcal_calibration_options_set_lens) only the boards' poses are found. One view is enough when it is
 * tilted; the principal point is then expected near the image's centre.
 *
 * @param boards  The views.
 * @param options The options; may be NULL: the defaults.
 * @param result  Receives the calibration; free it with ptzcal_board_calibration_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_DEGENERATE (parallel boards;
 *         message and hint say what to add); PTZCAL_STATUS_NO_CONSENSUS;
 *         PTZCAL_STATUS_INVALID_ARGUMENT (the message names a view that is mirrored or does not fit);
 *         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibrate_from_boards(const ptzcal_boards *boards,
                                           const ptzcal_calibration_options *options,
                                           ptzcal_board_calibration **result,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a calibration from boards. Strings taken from it die with it.
 *
 * @param calibration The calibration; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_board_calibration_free(ptzcal_board_calibration *calibration) PTZCAL_NOEXCEPT;

/**
 * The camera's calibration, as any other: intrinsics, lens and their covariance; its pose is the
 * identity. Its measurements are all corners, view after view.
 *
 * @param calibration The calibration from boards.
 * @param camera      Receives a calibration of its own; free it with ptzcal_calibration_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_board_calibration_copy_camera(const ptzcal_board_calibration *calibration,
                                                   ptzcal_calibration **camera,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many views there are.
 *
 * @param calibration The calibration from boards.
 * @param count       Receives the number.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_board_calibration_count(const ptzcal_board_calibration *calibration,
                                             size_t *count,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a view: rotation 1, everything else 0.
 *
 * @param view The struct.
 * @param size sizeof *view.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_board_view_init(ptzcal_board_view *view, size_t size) PTZCAL_NOEXCEPT;

/**
 * What was found about one view.
 *
 * @param calibration The calibration from boards.
 * @param number      The view.
 * @param view        Receives it; set up by ptzcal_board_view_init.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a view that there is not.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_board_calibration_get_view(const ptzcal_board_calibration *calibration,
                                                uint32_t number,
                                                ptzcal_board_view *view,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How the boards bend: b1 b2 b3 of ptzcal_boards_set_bending; 0 for flat ones.
 *
 * @param calibration The calibration from boards.
 * @param bending     Receives 3 numbers, in the board's unit.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_board_calibration_get_bending(const ptzcal_board_calibration *calibration,
                                                   double *bending,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * What to add to make the calibration better, lines of English UTF-8, the most needed first.
 *
 * @param calibration The calibration from boards; may be NULL.
 * @return A string that lives as long as the calibration; "" when nothing is missing, and for NULL;
 *         never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_board_calibration_advice(const ptzcal_board_calibration *calibration) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * The laser's line
 *
 * Where the laser stands beside its camera and where it points, from views of boards with the laser
 * on (ptzcal_boards, places on the boards in metres): boards at all distances of the work, near ones
 * above all. Each spot is where the laser's line meets its board; line, poses and lens are adjusted
 * together. The result is a rig model that is ready for use, and a covariance of all that depths
 * depend on.
 * ============================================================================================= */

/** A calibrated laser line. Immutable: any number of threads may read it. */
typedef struct ptzcal_laser_calibration ptzcal_laser_calibration;

/** A laser's line in its camera's frame: points (x0 + vx Z, y0 + vy Z, Z). */
typedef struct ptzcal_laser_line {
  /** Set by ptzcal_laser_line_init. */
  uint32_t struct_size;
  /** Spots used. */
  uint32_t spots;
  /** Metres. */
  double x0;
  /** Metres. */
  double y0;
  /** Slope, metres per metre of depth. */
  double vx;
  /** Slope, metres per metre of depth. */
  double vy;
  /** Root mean square length of the used spots' residuals, pixels. */
  double rms;
  /**
   * 7 x 7, row-major: of x0, y0 (metres), vx, vy (slopes), the logarithm of the common scale of fx
   * and fy, cx, cy (pixels). The first four rows and columns are the line's own; those of a lens
   * that was not free are 0.
   */
  double covariance[49];
} ptzcal_laser_line;

/**
 * Calibrates the laser's line. The lens comes from the same corners; or it is known exactly
 * (ptzcal_calibration_options_set_lens); or it was measured before, from other images, and its
 * covariance is believed. Spots that disagree with most others are set aside.
 *
 * @param boards  The views, with the spots of two or more.
 * @param lens    The lens that was measured before; may be NULL. A calibration from these same views would
 *                count them twice.
 * @param options The options; may be NULL: the defaults.
 * @param laser   Receives the result; free it with ptzcal_laser_calibration_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; what ptzcal_calibrate_from_boards returns; PTZCAL_STATUS_TOO_FEW_POINTS
 *         (fewer than two spots); PTZCAL_STATUS_DEGENERATE (boards at one distance, a laser along a board,
 *         spots that do not move: the message says which); PTZCAL_STATUS_NO_CONSENSUS;
 *         PTZCAL_STATUS_INVALID_ARGUMENT (a baseline below 1 mm, or a lens in both places).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibrate_laser_line(const ptzcal_boards *boards,
                                          const ptzcal_calibration *lens,
                                          const ptzcal_calibration_options *options,
                                          ptzcal_laser_calibration **laser,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a laser calibration.
 *
 * @param laser The laser calibration; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_laser_calibration_free(ptzcal_laser_calibration *laser) PTZCAL_NOEXCEPT;

/**
 * Sets up a line: everything 0.
 *
 * @param line The struct.
 * @param size sizeof *line.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_line_init(ptzcal_laser_line *line, size_t size) PTZCAL_NOEXCEPT;

/**
 * The laser's line and its covariance.
 *
 * @param laser The laser calibration.
 * @param line  Receives the line; set up by ptzcal_laser_line_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_calibration_get_line(const ptzcal_laser_calibration *laser,
                                                ptzcal_laser_line *line,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A rig with the lens and the laser that were found; axes through the camera's centre, true encoders.
 *
 * @param laser The laser calibration.
 * @param model Receives the rig model; set up by ptzcal_rig_model_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_calibration_get_rig_model(const ptzcal_laser_calibration *laser,
                                                     ptzcal_rig_model *model,
                                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Lens and poses as the joint adjustment left them.
 *
 * @param laser  The laser calibration.
 * @param boards Receives a calibration of its own; free it with ptzcal_board_calibration_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_calibration_copy_boards(const ptzcal_laser_calibration *laser,
                                                   ptzcal_board_calibration **boards,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Measured minus predicted pixel of the spot of every view, outliers included: n x 2 numbers, n the
 * number of views. Infinite where there is no spot, or none is predicted.
 *
 * @param laser    The laser calibration.
 * @param buffer   Receives the numbers; may be NULL when capacity is 0.
 * @param capacity How many numbers the buffer holds.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_calibration_copy_residuals(const ptzcal_laser_calibration *laser,
                                                      double *buffer,
                                                      size_t capacity,
                                                      size_t *needed,
                                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Which views' spots were used: n bytes, n the number of views; 1 for a spot that was used, 0 for an
 * outlier and where there is no spot.
 *
 * @param laser    The laser calibration.
 * @param buffer   Receives the bytes; may be NULL when capacity is 0.
 * @param capacity How many bytes the buffer holds.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_laser_calibration_copy_inliers(const ptzcal_laser_calibration *laser,
                                                    uint8_t *buffer,
                                                    size_t capacity,
                                                    size_t *needed,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Rigs over zoom
 *
 * Lens and laser line of a rig at every zoom between those that were calibrated
 * (ptzcal_rig_calibrated_get_curve), with covariances: the focal length by a monotone spline, the
 * principal point and the laser line's image by a smooth one. Zoom is the device's own number, in any
 * unit that grows or falls with the focal length.
 * ============================================================================================= */

/** A rig over zoom. Immutable: any number of threads may read it. */
typedef struct ptzcal_zoom_curve ptzcal_zoom_curve;

/**
 * Frees a curve.
 *
 * @param curve The curve; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_zoom_curve_free(ptzcal_zoom_curve *curve) PTZCAL_NOEXCEPT;

/**
 * The rig at a zoom; axes through the camera's centre, true encoders.
 *
 * @param curve      The curve.
 * @param zoom       Within the curve's range; of a single calibrated position: that position.
 * @param model      Receives the rig model; set up by ptzcal_rig_model_init.
 * @param covariance Receives 49 numbers, 7 x 7: as in ptzcal_laser_line, with the interpolation's own error;
 *                   may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (outside the range);
 *         PTZCAL_STATUS_LENS_NOT_MONOTONE (the interpolated lens folds inside the image).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_zoom_curve_get_rig_model(const ptzcal_zoom_curve *curve,
                                              double zoom,
                                              ptzcal_rig_model *model,
                                              double *covariance,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The zooms that a curve answers for.
 *
 * @param curve The curve.
 * @param low   Receives the least.
 * @param high  Receives the greatest.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_zoom_curve_get_range(const ptzcal_zoom_curve *curve,
                                          double *low,
                                          double *high,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a curve as JSON, every number to its last bit.
 *
 * @param curve The curve.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_zoom_curve_save(const ptzcal_zoom_curve *curve,
                                     const char *path,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads a curve from a file of ptzcal_zoom_curve_save.
 *
 * @param path  The file.
 * @param curve Receives the curve; free it with ptzcal_zoom_curve_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the key
 *         or the line); PTZCAL_STATUS_FILE_VERSION.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_zoom_curve_load(const char *path,
                                     ptzcal_zoom_curve **curve,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * A calibrated rig
 *
 * What became of every zoom position and of every view: nothing that was measured is lost because
 * something else failed. Zoom positions are numbered from 0, ascending; views as they were added.
 * ============================================================================================= */

/** A calibrated rig. Immutable: any number of threads may read it. */
typedef struct ptzcal_rig_calibrated ptzcal_rig_calibrated;

/** What became of a zoom position. */
typedef struct ptzcal_zoom_position {
  /** Set by ptzcal_zoom_position_init. */
  uint32_t struct_size;
  /** A ptzcal_status: PTZCAL_STATUS_OK when lens and poses were found. */
  int32_t status;
  /** A ptzcal_status: PTZCAL_STATUS_OK when the laser's line was found from this position's views. */
  int32_t laser_status;
  /** 1 when there is a rig model: a lens, and a line of its own or from the other positions. */
  uint32_t has_model;
  /** Views at this position, and how many of them were used. */
  uint32_t views;
  /** Views used for the lens. */
  uint32_t views_used;
  /** Spots used. */
  uint32_t spots_used;
  /** 0. */
  uint32_t reserved;
  /** The device's number of the position. */
  double zoom;
  /** Root mean square length of the used corners' residuals, pixels. */
  double rms;
} ptzcal_zoom_position;

/** The laser's line as all zoom positions see it. */
typedef struct ptzcal_common_line {
  /** Set by ptzcal_common_line_init. */
  uint32_t struct_size;
  /**
   * 1 when the positions' lines are one line (a chance of 1 in 1000 or more); else every position keeps
   * its own.
   */
  uint32_t agrees;
  /** Zoom positions that saw the spot. */
  uint32_t positions;
  /** Degrees of freedom of chi2. */
  uint32_t degrees_of_freedom;
  /** In the camera's frame at the first of them. Metres. */
  double x0;
  /** Metres. */
  double y0;
  /** Slope, metres per metre of depth. */
  double vx;
  /** Slope, metres per metre of depth. */
  double vy;
  /** 4 x 4, row-major: of x0, y0, vx, vy. */
  double covariance[16];
  /** Disagreement of the positions' own lines. */
  double chi2;
  /** Chance of such a disagreement or a larger one. */
  double probability;
  /** When they do not agree: the position without which the others agree best; NaN when nobody can tell. */
  double odd_zoom;
} ptzcal_common_line;

/**
 * Frees a calibrated rig.
 *
 * @param calibrated The calibrated rig; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_rig_calibrated_free(ptzcal_rig_calibrated *calibrated) PTZCAL_NOEXCEPT;

/**
 * How many zoom positions and views there are.
 *
 * @param calibrated The calibrated rig.
 * @param positions  Receives the number of zoom positions.
 * @param views      Receives the number of views.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_count(const ptzcal_rig_calibrated *calibrated,
                                          uint32_t *positions,
                                          uint32_t *views,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a zoom position: everything 0.
 *
 * @param position The struct.
 * @param size     sizeof *position.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_zoom_position_init(ptzcal_zoom_position *position,
                                        size_t size) PTZCAL_NOEXCEPT;

/**
 * What became of a zoom position.
 *
 * @param calibrated The calibrated rig.
 * @param index      The zoom position.
 * @param position   Receives it; set up by ptzcal_zoom_position_init.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_get_position(const ptzcal_rig_calibrated *calibrated,
                                                 uint32_t index,
                                                 ptzcal_zoom_position *position,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Why there is no lens at a zoom position, one line of English UTF-8. The wording may change in any version; decide by the status.
 *
 * @param calibrated The calibrated rig; may be NULL.
 * @param index      The zoom position.
 * @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
 *         for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_rig_calibrated_position_reason(const ptzcal_rig_calibrated *calibrated,
                                                  uint32_t index) PTZCAL_NOEXCEPT;

/**
 * Why a zoom position has no laser line of its own, one line of English UTF-8. The wording may change in any version; decide by the status.
 *
 * @param calibrated The calibrated rig; may be NULL.
 * @param index      The zoom position.
 * @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
 *         for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_rig_calibrated_laser_reason(const ptzcal_rig_calibrated *calibrated,
                                               uint32_t index) PTZCAL_NOEXCEPT;

/**
 * The rig at a zoom position; axes through the camera's centre, true encoders. Its laser line is the one
 * that all positions share, if they do.
 *
 * @param calibrated The calibrated rig.
 * @param index      The zoom position.
 * @param model      Receives the rig model; set up by ptzcal_rig_model_init.
 * @param covariance Receives 49 numbers, 7 x 7: as in ptzcal_laser_line; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is no lens, or no laser line.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_get_rig_model(const ptzcal_rig_calibrated *calibrated,
                                                  uint32_t index,
                                                  ptzcal_rig_model *model,
                                                  double *covariance,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Lens and poses of a zoom position, from its own views alone.
 *
 * @param calibrated The calibrated rig.
 * @param index      The zoom position.
 * @param boards     Receives a calibration of its own; free it with ptzcal_board_calibration_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_copy_boards(const ptzcal_rig_calibrated *calibrated,
                                                uint32_t index,
                                                ptzcal_board_calibration **boards,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Lens, poses and laser line of a zoom position, from its own views alone.
 *
 * @param calibrated The calibrated rig.
 * @param index      The zoom position.
 * @param laser      Receives a calibration of its own; free it with ptzcal_laser_calibration_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number); why there is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_copy_laser(const ptzcal_rig_calibrated *calibrated,
                                               uint32_t index,
                                               ptzcal_laser_calibration **laser,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a line: everything 0.
 *
 * @param line The struct.
 * @param size sizeof *line.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_common_line_init(ptzcal_common_line *line, size_t size) PTZCAL_NOEXCEPT;

/**
 * The laser's line as all zoom positions see it, and whether they agree.
 *
 * @param calibrated The calibrated rig.
 * @param line       Receives the line; set up by ptzcal_common_line_init.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND (fewer than two zoom positions saw the spot).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_get_common_line(const ptzcal_rig_calibrated *calibrated,
                                                    ptzcal_common_line *line,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The rig over zoom, from all positions that have a rig model.
 *
 * @param calibrated The calibrated rig.
 * @param curve      Receives a curve of its own; free it with ptzcal_zoom_curve_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS (no position has a rig model);
 *         PTZCAL_STATUS_INVALID_ARGUMENT (the focal length does not grow or fall from position to position:
 *         the message names two).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_get_curve(const ptzcal_rig_calibrated *calibrated,
                                              ptzcal_zoom_curve **curve,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Views of a calibrated rig
 *
 * What became of each picture: its corners, their residuals, the board's pose, the spot, and the
 * reason where something was not used.
 * ============================================================================================= */

/** What became of a view. */
typedef struct ptzcal_rig_view {
  /** Set by ptzcal_rig_view_init. */
  uint32_t struct_size;
  /** A ptzcal_status: PTZCAL_STATUS_OK when the view was used; ptzcal_rig_calibrated_view_reason says why not. */
  int32_t status;
  /** A ptzcal_status: PTZCAL_STATUS_OK when its spot was used, or there is no picture with the laser on. */
  int32_t spot_status;
  /** 1 when a spot was seen. */
  uint32_t has_spot;
  /** 1 when the board's pose is known. */
  uint32_t has_pose;
  /** 0. */
  uint32_t reserved;
  /** Corners found. */
  uint64_t corners;
  /** Corners used. */
  uint64_t inliers;
  /** The device's number of the zoom position. */
  double zoom;
  /** Root mean square length of the used corners' residuals, pixels. */
  double rms;
  /** The spot's pixel. */
  double spot[2];
  /** Measured minus predicted, pixels; 0 where none is predicted. */
  double spot_residual[2];
  /** R, row-major: board axes to camera axes. The board's plane is R's third column through t. */
  double rotation[9];
  /** t: the middle of the board's corners in the camera frame, metres. */
  double translation[3];
} ptzcal_rig_view;

/**
 * Sets up a view: no turn, everything else 0.
 *
 * @param rig_view The struct.
 * @param size     sizeof *rig_view.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_view_init(ptzcal_rig_view *rig_view, size_t size) PTZCAL_NOEXCEPT;

/**
 * What became of a view.
 *
 * @param calibrated The calibrated rig.
 * @param view       The view.
 * @param rig_view   Receives it; set up by ptzcal_rig_view_init.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such number).
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_get_view(const ptzcal_rig_calibrated *calibrated,
                                             uint32_t view,
                                             ptzcal_rig_view *rig_view,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Why a view was not used, one line of English UTF-8. The wording may change in any version; decide by the status.
 *
 * @param calibrated The calibrated rig; may be NULL.
 * @param view       The view.
 * @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
 *         for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_rig_calibrated_view_reason(const ptzcal_rig_calibrated *calibrated,
                                              uint32_t view) PTZCAL_NOEXCEPT;

/**
 * Why a view's spot was not used, one line of English UTF-8. The wording may change in any version; decide by the status.
 *
 * @param calibrated The calibrated rig; may be NULL.
 * @param view       The view.
 * @return A string that lives as long as the calibrated rig; "" when there is no reason, no such number and
 *         for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_rig_calibrated_spot_reason(const ptzcal_rig_calibrated *calibrated,
                                              uint32_t view) PTZCAL_NOEXCEPT;

/**
 * The corners of a view, for tables and pictures.
 *
 * @param calibrated The calibrated rig.
 * @param view       The view.
 * @param board_xy   Receives n x 2 numbers: places on the board, metres; may be NULL.
 * @param uv         Receives n x 2 numbers: their pixels; may be NULL.
 * @param residuals  Receives n x 2 numbers: measured minus predicted, px; infinite where none is predicted; may be NULL.
 * @param inliers    Receives n numbers: 1 for a corner that was used; may be NULL.
 * @param capacity   How many corners each array holds.
 * @param needed     Receives n, also when it is more than the capacity; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view); PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibrated_copy_corners(const ptzcal_rig_calibrated *calibrated,
                                                 uint32_t view,
                                                 double *board_xy,
                                                 double *uv,
                                                 double *residuals,
                                                 uint8_t *inliers,
                                                 size_t capacity,
                                                 size_t *needed,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Calibrating a rig from pictures
 *
 * The whole way from pictures of a chessboard to a rig: the board held in different ways 1 to 5 m
 * away, tilted by 20 to 40 degrees this way and that, near and far; of each place one picture with
 * the laser off and one with it on; for one zoom position, or for several. Views in which nothing is
 * found keep the reason and cost nothing else; a zoom position that stays open costs none of the
 * others. Without pictures with the laser on, the lens alone is calibrated. Views are numbered from 0
 * in the order of adding.
 * ============================================================================================= */

/** Views of chessboards by the camera of a rig. */
typedef struct ptzcal_rig_calibration ptzcal_rig_calibration;

/**
 * Makes an empty set of views. The options are copied.
 *
 * @param columns     Inner corners in a row of the board, 3 to 128.
 * @param rows        Inner corners in a column, 3 to 128. With one even and one odd number boards cannot be
 *                    mistaken for turned ones.
 * @param square      Side of a square, metres.
 * @param options     Lens model and how it is fitted, without a fixed lens; may be NULL: the defaults.
 * @param spot        The search for the spot, which is looked for on the board only; may be NULL: the
 *                    defaults.
 * @param calibration Receives the set; free it with ptzcal_rig_calibration_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a board that cannot be, a fixed lens, options
 *         out of range); PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_new(uint32_t columns,
                                         uint32_t rows,
                                         double square,
                                         const ptzcal_calibration_options *options,
                                         const ptzcal_spot_options *spot,
                                         ptzcal_rig_calibration **calibration,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a set of views. What was calibrated from it lives on.
 *
 * @param calibration The set; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_rig_calibration_free(ptzcal_rig_calibration *calibration) PTZCAL_NOEXCEPT;

/**
 * The board of the views that are added from now on: near, or at a long focal length, a smaller one
 * fits into the image.
 *
 * @param calibration The set.
 * @param columns     Inner corners in a row, 3 to 128.
 * @param rows        Inner corners in a column, 3 to 128.
 * @param square      Side of a square, metres.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_set_board(ptzcal_rig_calibration *calibration,
                                               uint32_t columns,
                                               uint32_t rows,
                                               double square,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Whether the zoom positions share one laser line. They do by default: the laser is fixed to the
 * camera, and zooming moves the camera's centre along its axis only. The data are asked: where they
 * contradict it, every position keeps its own line.
 *
 * @param calibration The set.
 * @param share       0: every position keeps its own line; else they share one.
 * @param pupil_sigma How far the camera's centre moves with the zoom: a standard deviation in metres; 0.05 by
 *                    default.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (negative); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_set_common_line(ptzcal_rig_calibration *calibration,
                                                     int32_t share,
                                                     double pupil_sigma,
                                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a picture of the board with the laser off and one with it on, the head at rest. That nothing
 * is found in them is no error: the view keeps the reason (ptzcal_rig_calibrated_view_reason).
 *
 * @param calibration The set.
 * @param zoom        The device's own number of the zoom position, in any unit that grows or falls with
 *                    the focal length; views of one position have the same number.
 * @param off         With the laser off.
 * @param on          The same with the laser on; may be NULL: this view is for the lens only.
 * @param view        Receives the view's number; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a malformed image, or one of another size than
 *         those before); PTZCAL_STATUS_BUFFER_TOO_SMALL (a plane's size cannot hold the image);
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_add_images(ptzcal_rig_calibration *calibration,
                                                double zoom,
                                                const ptzcal_image *off,
                                                const ptzcal_image *on,
                                                uint32_t *view,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds corners that were found elsewhere.
 *
 * @param calibration   The set.
 * @param zoom          As for ptzcal_rig_calibration_add_images.
 * @param image_width   Pixels; the same for all views.
 * @param image_height  Pixels; the same for all views.
 * @param board_xy      n x 2 numbers: places on the board, metres.
 * @param uv            n x 2 numbers: their pixels.
 * @param uv_covariance n x 3 numbers: xx, xy, yy of each pixel, positive definite, px^2; may be NULL: the
 *                      common noise that the options state, or that the residuals show.
 * @param n             Number of corners, 4 or more.
 * @param view          Receives the view's number; may be NULL.
 * @param error         Receives the error; may be NULL.
 * @return What ptzcal_boards_add_view returns; PTZCAL_STATUS_INVALID_ARGUMENT also for an image of another
 *         size than those before.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_add_corners(ptzcal_rig_calibration *calibration,
                                                 double zoom,
                                                 uint32_t image_width,
                                                 uint32_t image_height,
                                                 const double *board_xy,
                                                 const double *uv,
                                                 const double *uv_covariance,
                                                 size_t n,
                                                 uint32_t *view,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the laser's spot on the board of a view was seen; replaces what was found.
 *
 * @param calibration   The set.
 * @param view          The view; a board was found in it.
 * @param uv            2 numbers: the spot's pixel.
 * @param uv_covariance 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: the common noise of
 *                      the corners.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (no such view, no board in it, a covariance
 *         that is none); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_set_spot(ptzcal_rig_calibration *calibration,
                                              uint32_t view,
                                              const double *uv,
                                              const double *uv_covariance,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Calibrates every zoom position: lens, laser line and all board poses by maximum likelihood
 * together, then one laser line for all positions. What fails at a position is said there
 * (ptzcal_rig_calibrated_get_position).
 *
 * @param calibration The set.
 * @param calibrated  Receives the answer; free it with ptzcal_rig_calibrated_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS (no views); PTZCAL_STATUS_CANCELLED (the options'
 *         token); PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_calibration_solve(const ptzcal_rig_calibration *calibration,
                                           ptzcal_rig_calibrated **calibrated,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Calibrating from colour and depth
 *
 * A fixed camera from the views of an auxiliary camera with depth, where both see the same textured
 * things: no laser and no marks are needed. SIFT features of both images are matched, the auxiliary
 * ones become points by their depth, and those pairs calibrate the fixed camera; then it tells which
 * straight edges of both images are one, and is calibrated once more from points and lines (thesis,
 * section IV.B).
 *
 * Make a ptzcal_rgbd of the fixed camera's image, add the auxiliary views, and calibrate. The world
 * is that of the auxiliary cameras' poses.
 * ============================================================================================= */

/**
 * Numbers of a pair of points: the view, x and y in its image, x and y in the fixed camera's (pixels),
 * and the point in the world (metres).
 */
#define PTZCAL_RGBD_PAIR_SIZE 8

/**
 * Numbers of a pair of lines: the view, x and y of both ends in its image, x and y of both ends in the
 * fixed camera's (pixels), and of the line in the world a point (metres) and its direction (length 1).
 */
#define PTZCAL_RGBD_LINE_SIZE 15

/** A fixed camera's image and what auxiliary views share with it. */
typedef struct ptzcal_rgbd ptzcal_rgbd;

/** How pairs are found. */
typedef struct ptzcal_rgbd_options {
  /** Set by ptzcal_rgbd_options_init. */
  uint32_t struct_size;
  /** Least number of pairs that agree with the camera, 6 or more. */
  uint32_t min_pairs;
  /**
   * 1: once more with those pairs of features that look less distinct but lie where a first camera
   * expects them; 0: no.
   */
  uint32_t guided;
  /** 1: with the straight edges that both images show; 0: with points alone. */
  uint32_t lines;
  /** Least contrast of a SIFT feature, above 0 to 1. */
  double contrast_threshold;
  /** Greatest ratio of a feature's principal curvatures, above 1. */
  double edge_ratio;
  /** Greatest ratio of the distances to the nearest and the second nearest feature, above 0 to 1. */
  double max_ratio;
  /**
   * Standard deviation of inverse depths, 1/m: for cameras that triangulate. 0.001425 is a Kinect's of
   * the first kind.
   */
  double inverse_depth_sigma;
  /** Standard deviation of depths besides, metres: for cameras that measure time of flight. */
  double depth_sigma;
  /**
   * Standard deviation of a feature's place, across its elongation, in pixels; 0: estimated from the
   * residuals.
   */
  double keypoint_sigma;
} ptzcal_rgbd_options;

/** What an auxiliary view has to offer. */
typedef struct ptzcal_rgbd_view {
  /** Set by ptzcal_rgbd_view_init. */
  uint32_t struct_size;
  /** Features of its image. */
  uint32_t features;
  /** Of them, those that have a depth. */
  uint32_t with_depth;
  /** Features that look like one of the fixed camera's image. */
  uint32_t matches;
  /** Of these, those that have a depth. */
  uint32_t pairs;
  /** Straight edges of its image that have a depth. */
  uint32_t lines;
} ptzcal_rgbd_view;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_options_init(ptzcal_rgbd_options *options,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a view's counts: everything 0.
 *
 * @param view The struct.
 * @param size sizeof *view.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_view_init(ptzcal_rgbd_view *view, size_t size) PTZCAL_NOEXCEPT;

/**
 * Begins with the fixed camera's image.
 *
 * @param fixed   The image; it is not needed after the call.
 * @param options The options; may be NULL: the defaults.
 * @param rgbd    Receives the handle; free it with ptzcal_rgbd_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for options out of range and for a malformed
 *         or too small image; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_new(const ptzcal_image *fixed,
                              const ptzcal_rgbd_options *options,
                              ptzcal_rgbd **rgbd,
                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees it.
 *
 * @param rgbd The handle; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_rgbd_free(ptzcal_rgbd *rgbd) PTZCAL_NOEXCEPT;

/**
 * Adds a view of an auxiliary camera. A view without texture or depth adds nothing; its counts say so.
 *
 * @param rgbd   The handle.
 * @param colour The auxiliary camera's image; it is not needed after the call.
 * @param depth  The depth of each of its pixels.
 * @param camera The auxiliary camera, of the image's size; its pose says what the world is.
 * @param counts Receives what the view has to offer; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another size and for a malformed image or
 *         camera; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_add_view(ptzcal_rgbd *rgbd,
                                   const ptzcal_image *colour,
                                   const ptzcal_depth_map *depth,
                                   const ptzcal_camera *camera,
                                   ptzcal_rgbd_view *counts,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Calibrates the fixed camera from all views added so far. Views may be added later and the camera
 * calibrated again.
 *
 * The calibration's residuals and inliers are those of the pairs that ptzcal_rgbd_copy_pairs gives, in
 * their order, and then of the lines of ptzcal_rgbd_copy_lines.
 *
 * @param rgbd    The handle.
 * @param options The options; may be NULL: the defaults.
 * @param result  Receives the calibration; free it with ptzcal_calibration_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS where the images have too little in common
 *         (the message says what there is); PTZCAL_STATUS_DEGENERATE; PTZCAL_STATUS_NO_CONSENSUS;
 *         PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE; PTZCAL_STATUS_CANCELLED;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_calibrate(ptzcal_rgbd *rgbd,
                                    const ptzcal_calibration_options *options,
                                    ptzcal_calibration **result,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the pairs of points of the last calibration, PTZCAL_RGBD_PAIR_SIZE numbers each.
 *
 * @param rgbd     The handle.
 * @param pairs    Receives view, auxiliary x, y, fixed x, y, world X, Y, Z of each; may be NULL when
 *                 `capacity` is 0.
 * @param capacity Numbers that the buffer holds.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE before the first
 *         calibration; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_copy_pairs(const ptzcal_rgbd *rgbd,
                                     double *pairs,
                                     size_t capacity,
                                     size_t *needed,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the pairs of lines of the last calibration, PTZCAL_RGBD_LINE_SIZE numbers each.
 *
 * @param rgbd     The handle.
 * @param lines    Receives view, auxiliary x0, y0, x1, y1, fixed x0, y0, x1, y1, point X, Y, Z, direction
 *                 X, Y, Z of each; may be NULL when `capacity` is 0.
 * @param capacity Numbers that the buffer holds.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE before the first
 *         calibration; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rgbd_copy_lines(const ptzcal_rgbd *rgbd,
                                     double *lines,
                                     size_t capacity,
                                     size_t *needed,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Planes and roof edges
 *
 * A roof edge is the line where two planes meet: wall and floor, two faces of a box. Two stations of
 * a rig that measured the same two edges (or more) are tied by them. Add to each station's set its
 * planes, fitted to the laser shots of a region, and its edges as pairs of planes: the same edges in
 * the same order, with their planes in the same order.
 * ============================================================================================= */

/** The planes and roof edges that one station measured. */
typedef struct ptzcal_roof_edges ptzcal_roof_edges;

/**
 * Makes an empty set of planes and edges for one station.
 *
 * @param edges Receives the set; free it with ptzcal_roof_edges_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_new(ptzcal_roof_edges **edges,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a set.
 *
 * @param edges The set; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_roof_edges_free(ptzcal_roof_edges *edges) PTZCAL_NOEXCEPT;

/**
 * Adds a plane fitted to laser shots by maximum likelihood in inverse depth. Gross outliers are set
 * aside.
 *
 * @param edges           The set.
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots, at least 3.
 * @param plane           Receives the plane's number in the set, for ptzcal_roof_edges_add_edge.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_DEGENERATE for shots on one line or a plane through the rig;
 *         PTZCAL_STATUS_NO_CONSENSUS when no half of the shots agrees on a plane;
 *         PTZCAL_STATUS_BEHIND_CAMERA; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_add_plane_shots(ptzcal_roof_edges *edges,
                                                const ptzcal_rig_model *model,
                                                const double *pan_tilt,
                                                const double *spots,
                                                const double *spot_covariance,
                                                size_t n,
                                                uint32_t *plane,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a plane fitted to points in the station's frame by total least squares. Gross outliers are
 * set aside.
 *
 * @param edges The set.
 * @param xyz   n x 3 numbers: points, metres.
 * @param n     Number of points: at least 3, or 4 when sigma is 0.
 * @param sigma Standard deviation of the points in each direction, metres; 0: estimated from how
 *              far they are from the plane.
 * @param plane Receives the plane's number in the set.
 * @param error Receives the error; may be NULL.
 * @return As ptzcal_roof_edges_add_plane_shots.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_add_plane_points(ptzcal_roof_edges *edges,
                                                 const double *xyz,
                                                 size_t n,
                                                 double sigma,
                                                 uint32_t *plane,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a plane that is known: normal . X = distance in the station's frame.
 *
 * @param edges      The set.
 * @param normal     3 numbers of any length but 0.
 * @param distance   Metres; not 0: the plane must not pass through the station.
 * @param covariance 9 numbers: covariance of n = normal / distance, row-major, 1 / m^2; may be NULL:
 *                   the plane is exact.
 * @param plane      Receives the plane's number in the set.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_DEGENERATE for a plane through the station; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_add_plane(ptzcal_roof_edges *edges,
                                          const double *normal,
                                          double distance,
                                          const double *covariance,
                                          uint32_t *plane,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds the edge where two of the station's planes meet.
 *
 * @param edges  The set.
 * @param first  Number of a plane.
 * @param second Number of another plane. The order matters: it must be the same in both stations.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_add_edge(ptzcal_roof_edges *edges,
                                         uint32_t first,
                                         uint32_t second,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Rig poses by roof edges
 *
 * The pose of one station of a rig in another's frame, from the roof edges that both measured.
 * ============================================================================================= */

/** How a pose is computed from roof edges. */
enum {
  /** Rigid Procrustes on points of the edges (Gois and Gaspar): the default. */
  PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES = 0,
  /** Closed form on the planes themselves; more accurate. */
  PTZCAL_POSE_METHOD_PLANE_TO_PLANE = 1,
  /** The planes weighted by their full covariances; the most accurate. */
  PTZCAL_POSE_METHOD_MAXIMUM_LIKELIHOOD = 2,
};
typedef uint32_t ptzcal_pose_method;

/** The pose of station b in station a's frame. Immutable: any number of threads may read it. */
typedef struct ptzcal_pose_estimate ptzcal_pose_estimate;

/** How a pose is estimated. */
typedef struct ptzcal_pose_options ptzcal_pose_options;

/** The pose of one station in another's frame. */
typedef struct ptzcal_pose {
  /** Set by ptzcal_pose_init. */
  uint32_t struct_size;
  /** 0. */
  uint32_t reserved;
  /** R, row-major, in X_a = R X_b + t. */
  double rotation[9];
  /** t, metres: the position of station b in station a's frame. */
  double translation[3];
  /** Angle of R, radians. */
  double rotation_angle;
  /** Root mean square distance between the two stations' points on the edges, metres. */
  double residual_rms;
  /**
   * Largest difference that is left between the two stations' planes: of their unit normals, and
   * of their distances relative to the edges' mean distance.
   */
  double disagreement;
  /** How much better the best-determined direction is than the worst; 1 at best. */
  double condition;
} ptzcal_pose;

/**
 * Makes options with their defaults: roof-edge Procrustes, levers of the scene's size, planes and
 * edges at least 5 degrees apart.
 *
 * @param options Receives the options; free them with ptzcal_pose_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_options_new(ptzcal_pose_options **options,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_pose_options_free(ptzcal_pose_options *options) PTZCAL_NOEXCEPT;

/**
 * Sets the method.
 *
 * @param options The options.
 * @param method  A ptzcal_pose_method; the default is PTZCAL_POSE_METHOD_ROOF_EDGE_PROCRUSTES.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_options_set_method(ptzcal_pose_options *options,
                                             uint32_t method,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how far along an edge its second point lies (Procrustes only).
 *
 * @param options The options.
 * @param lever   Metres, positive; 0 (the default): the edges' mean distance from the stations.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_options_set_lever(ptzcal_pose_options *options,
                                            double lever,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the angles below which planes make no edge and edges count as parallel.
 *
 * @param options        The options.
 * @param min_plane_angle Radians, 0 to pi/2; the default is 5 degrees.
 * @param min_edge_angle  Radians, 0 to pi/2; the default is 5 degrees.
 * @param error          Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_options_set_min_angles(ptzcal_pose_options *options,
                                                 double min_plane_angle,
                                                 double min_edge_angle,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Estimates the pose of station b in station a's frame from the roof edges that both measured.
 *
 * @param station_a The first station's planes and edges.
 * @param station_b The second station's: the same edges in the same order.
 * @param options   The options; may be NULL: the defaults.
 * @param result    Receives the estimate; free it with ptzcal_pose_estimate_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for unequal or fewer than two edges and
 *         for stations that did not see the same planes; PTZCAL_STATUS_DEGENERATE for parallel
 *         planes or edges (the message says what is unobservable); PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_estimate_pose_roof_edges(const ptzcal_roof_edges *station_a,
                                              const ptzcal_roof_edges *station_b,
                                              const ptzcal_pose_options *options,
                                              ptzcal_pose_estimate **result,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees an estimate.
 *
 * @param estimate The estimate; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_pose_estimate_free(ptzcal_pose_estimate *estimate) PTZCAL_NOEXCEPT;

/**
 * Sets up a pose: the identity.
 *
 * @param pose The struct.
 * @param size sizeof *pose.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_init(ptzcal_pose *pose, size_t size) PTZCAL_NOEXCEPT;

/**
 * The pose.
 *
 * @param estimate The estimate.
 * @param pose     Receives the pose; set up by ptzcal_pose_init.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_estimate_get(const ptzcal_pose_estimate *estimate,
                                       ptzcal_pose *pose,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the 6 x 6 covariance of the pose, row-major: of the rotation vector w in R <- exp([w]x) R
 * (radians, axes of station a) and of the translation (metres).
 *
 * @param estimate The estimate.
 * @param buffer   Receives 36 numbers; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives 36; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pose_estimate_copy_covariance(const ptzcal_pose_estimate *estimate,
                                                   double *buffer,
                                                   size_t capacity,
                                                   size_t *needed,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Planes of scans
 *
 * The planes that a station sees (walls, floor, ceiling, faces of furniture), found in points, in laser
 * shots or in depths; each with its covariance, where it was measured, and which measurements belong to
 * it. Those of a scan, and those of regions that you name, have chapters of their own. Two stations' planes give the pose between them:
 * ptzcal_register_stations.
 *
 * A plane is n . X = 1 in the station's frame: n is the unit normal, away from the station, over the
 * distance. A plane through the station itself cannot be seen from it and is left out.
 * ============================================================================================= */

/** The planes of one station. Immutable: any number of threads may read it. */
typedef struct ptzcal_planes ptzcal_planes;

/** How planes are found. */
typedef struct ptzcal_planes_options {
  /** Set by ptzcal_planes_options_init. */
  uint32_t struct_size;
  /** Least number of measurements that make a plane, 4 or more. */
  uint32_t min_points;
  /** Most planes, 1 to 1000. */
  uint32_t max_planes;
  /** 0. */
  uint32_t reserved;
  /** Seed of the search: the same input and seed give the same planes. */
  uint64_t seed;
  /** Standard deviations within which a measurement belongs to a plane. */
  double threshold;
  /**
   * Standard deviation of real surfaces from planes, metres; added to that of the measurements. State
   * systematic errors of the instrument here too.
   */
  double flatness;
  /** Least share of the measurements that make a plane, 0 to 1. */
  double min_share;
  /** What is nearer to the station is left out (its own parts), metres. */
  double min_range;
  /** What is farther is left out, metres; may be infinite. */
  double max_range;
} ptzcal_planes_options;

/** One plane of a station. */
typedef struct ptzcal_plane {
  /** Set by ptzcal_plane_init. */
  uint32_t struct_size;
  /** Measurements that belong to it. */
  uint32_t count;
  /** n . X = 1: the unit normal, away from the station, over the distance, 1 / m. */
  double n[3];
  /** Of n, row-major, 1 / m^2. Larger than that of independent noise where the surface is not even. */
  double covariance[9];
  /** Middle of its measurements, on the plane, metres. */
  double centre[3];
  /** Two unit vectors in the plane, one after the other, that of the larger extent first. */
  double axes[6];
  /**
   * How far the measurements reach along the first axis, from where to where as seen from the centre,
   * and along the second, metres; one in a hundred lies beyond each end.
   */
  double extent[4];
  /** What of it is covered by measurements, m^2. */
  double area;
  /** Root mean square distance of the measurements from it, metres. */
  double rms;
  /** Root of chi-square over its degrees of freedom: about 1 when the stated noise was right. */
  double noise_factor;
} ptzcal_plane;

/**
 * Sets up options: three standard deviations, surfaces flat to 5 mm, planes of 0.3 % of the measurements
 * and of 25 at least, at any distance.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_options_init(ptzcal_planes_options *options,
                                         size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds the planes of a cloud of points, in the frame of the station that measured them.
 *
 * @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
 * @param n       Number of points.
 * @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from
 *                neighbours.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_DEGENERATE
 *         when sigma cannot be estimated.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_find_points(const double *xyz,
                                        size_t n,
                                        double sigma,
                                        const ptzcal_planes_options *options,
                                        ptzcal_planes **planes,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds the planes of a cloud of points that a scanner at the origin measured by their ranges: the noise is
 * along the rays, so that a slanted wall is known better than from points with the same noise in all
 * directions.
 *
 * @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
 * @param n       Number of points.
 * @param sigma   Standard deviation of the ranges, metres, more than 0.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_find_ranges(const double *xyz,
                                        size_t n,
                                        double sigma,
                                        const ptzcal_planes_options *options,
                                        ptzcal_planes **planes,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds the planes of laser shots, in the rig's frame. Spots at or beyond infinity are passed over.
 *
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param options         The options; may be NULL: the defaults.
 * @param planes          Receives the planes; free them with ptzcal_planes_free.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_find_shots(const ptzcal_rig_model *model,
                                       const double *pan_tilt,
                                       const double *spots,
                                       const double *spot_covariance,
                                       size_t n,
                                       const ptzcal_planes_options *options,
                                       ptzcal_planes **planes,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Finds the planes of a depth map, in the camera's frame. The camera's pose plays no part. The labels
 * (ptzcal_planes_copy_labels) are the pixels', row by row.
 *
 * @param map                 The depths.
 * @param camera              The camera that they are of.
 * @param inverse_depth_sigma Standard deviation of inverse depths, 1/m: for cameras that triangulate.
 * @param depth_sigma         Standard deviation of depths besides, metres.
 * @param options             The options; may be NULL: the defaults.
 * @param planes              Receives the planes; free them with ptzcal_planes_free.
 * @param error               Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_find_depths(const ptzcal_depth_map *map,
                                        const ptzcal_camera *camera,
                                        double inverse_depth_sigma,
                                        double depth_sigma,
                                        const ptzcal_planes_options *options,
                                        ptzcal_planes **planes,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees planes.
 *
 * @param planes The planes; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_planes_free(ptzcal_planes *planes) PTZCAL_NOEXCEPT;

/**
 * How many planes there are.
 *
 * @param planes The planes.
 * @param count  Receives their number.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_count(const ptzcal_planes *planes,
                                  uint32_t *count,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a plane: all zero.
 *
 * @param plane The struct.
 * @param size  sizeof *plane.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plane_init(ptzcal_plane *plane, size_t size) PTZCAL_NOEXCEPT;

/**
 * One plane: those that were found come the most significant first, those of regions in their order.
 *
 * @param planes The planes.
 * @param index  Which one, from 0.
 * @param plane  Receives the plane; set up by ptzcal_plane_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_get(const ptzcal_planes *planes,
                                uint32_t index,
                                ptzcal_plane *plane,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the plane of each measurement (point, shot or pixel) that was handed in: its number, or -1.
 *
 * @param planes   The planes.
 * @param buffer   Receives the numbers; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives the number of measurements; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_copy_labels(const ptzcal_planes *planes,
                                        int32_t *buffer,
                                        size_t capacity,
                                        size_t *needed,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The standard deviation of the points, metres: as stated, or as estimated; 0 for shots and depths,
 * which have each their own.
 *
 * @param planes The planes.
 * @param sigma  Receives the standard deviation.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_sigma(const ptzcal_planes *planes,
                                  double *sigma,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Planes of regions
 *
 * One plane for each part of a cloud or of laser shots that you name, in the order of naming: by a number
 * for each measurement, or by boxes.
 * ============================================================================================= */

/**
 * Fits one plane to each region of a cloud of points. Up to half of a region may be something else.
 *
 * @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
 * @param n       Number of points.
 * @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from how far
 *                they are from their planes.
 * @param region_of n numbers: the region of each point, from 0; -1: of none.
 * @param regions Number of regions, 1 to 1000.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         station; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE. The error's index is the
 *         region's number.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_points(const double *xyz,
                                       size_t n,
                                       double sigma,
                                       const int32_t *region_of,
                                       uint32_t regions,
                                       const ptzcal_planes_options *options,
                                       ptzcal_planes **planes,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fits one plane to what each of several boxes holds of a cloud of points. Up to half of that may be
 * something else.
 *
 * @param xyz     n x 3 numbers: points, metres; they may be infinite or NaN: those are passed over.
 * @param n       Number of points.
 * @param sigma   Standard deviation of the points in each direction, metres; 0: estimated from how far
 *                they are from their planes.
 * @param boxes   6 numbers a region: least x, y, z of a box, then greatest, metres, in the station's frame.
 * @param regions Number of boxes, 1 to 1000.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         station; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside; PTZCAL_STATUS_NOT_FINITE. The
 *         error's index is the box's number.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_points_in_boxes(const double *xyz,
                                                size_t n,
                                                double sigma,
                                                const double *boxes,
                                                uint32_t regions,
                                                const ptzcal_planes_options *options,
                                                ptzcal_planes **planes,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fits one plane to each region of laser shots. Up to half of a region may be something else.
 *
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param region_of       n numbers: the region of each shot, from 0; -1: of none.
 * @param regions         Number of regions, 1 to 1000.
 * @param options         The options; may be NULL: the defaults.
 * @param planes          Receives the planes; free them with ptzcal_planes_free.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         station; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE. The error's index is the
 *         region's number.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_shots(const ptzcal_rig_model *model,
                                      const double *pan_tilt,
                                      const double *spots,
                                      const double *spot_covariance,
                                      size_t n,
                                      const int32_t *region_of,
                                      uint32_t regions,
                                      const ptzcal_planes_options *options,
                                      ptzcal_planes **planes,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fits one plane to what each of several boxes holds of laser shots. Up to half of that may be something
 * else.
 *
 * @param model           The rig model.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param boxes           6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's
 *                        frame.
 * @param regions         Number of boxes, 1 to 1000.
 * @param options         The options; may be NULL: the defaults.
 * @param planes          Receives the planes; free them with ptzcal_planes_free.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         station; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside; PTZCAL_STATUS_NOT_FINITE. The
 *         error's index is the box's number.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_shots_in_boxes(const ptzcal_rig_model *model,
                                               const double *pan_tilt,
                                               const double *spots,
                                               const double *spot_covariance,
                                               size_t n,
                                               const double *boxes,
                                               uint32_t regions,
                                               const ptzcal_planes_options *options,
                                               ptzcal_planes **planes,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Poses between stations by planes
 *
 * The pose of one station in another's frame from the planes that both saw, without being told which
 * are the same. Poses that bring planes together are judged by what the stations saw: a surface of one
 * must not lie where the other saw through. What is ambiguous (an empty room, turned by half a turn, looks
 * like itself), or what nothing confirms, is refused and never guessed; a rough pose as prior settles it.
 * What the planes leave free (parallel walls, a corridor) is refused with directions in the message.
 * ============================================================================================= */

/**
 * A pose between two stations, and the planes that it is from. Immutable: any number of threads may
 * read it.
 */
typedef struct ptzcal_registration ptzcal_registration;

/** How two stations are registered. */
typedef struct ptzcal_station_options {
  /** Set by ptzcal_station_options_init. */
  uint32_t struct_size;
  /** 1: only poses within three standard deviations of the prior are considered; 0: all. */
  uint32_t has_prior;
  /** Planes are the same that, registered, differ by no more than this angle, radians, to 0.3. */
  double max_angle;
  /** And by no more than this in their distance, metres. */
  double max_distance;
  /** Of the places that both stations saw, the least share where both saw a surface, 0 to 1. */
  double min_agreement;
  /** Another pose that scores this share of the best one's score makes it ambiguous, 0 to 1. */
  double max_runner_up;
  /** R of the prior, row-major, in X_a = R X_b + t. */
  double prior_rotation[9];
  /** t of the prior, metres. */
  double prior_translation[3];
  /** Standard deviation of the angle by which the prior may be off, radians. */
  double prior_rotation_sigma;
  /** Standard deviation of the distance by which its position may be off, metres. */
  double prior_position_sigma;
} ptzcal_station_options;

/** The pose of station b in station a's frame, from planes. */
typedef struct ptzcal_station_pose {
  /** Set by ptzcal_station_pose_init. */
  uint32_t struct_size;
  /** Pairs of planes that are the same. */
  uint32_t matches;
  /** R, row-major, in X_a = R X_b + t. */
  double rotation[9];
  /** t, metres: the position of station b in station a's frame. */
  double translation[3];
  /**
   * 6 x 6, row-major: of the rotation vector w in R <- exp([w]x) R (radians, axes of station a) and of
   * the translation (metres). Larger where the planes' differences contradict their covariances.
   */
  double covariance[36];
  /** Sum of squares of the planes' differences, in their standard deviations. */
  double chi2;
  /** Three for each pair of planes, less six. */
  double degrees_of_freedom;
  /** How much better the best-determined direction is than the worst; 1 at best. */
  double condition;
  /** Of the places that both stations saw, the share where both saw a surface. */
  double agreement;
  /** The score of the best other pose, relative to this one's; 0 where there is none. */
  double runner_up;
} ptzcal_station_pose;

/**
 * Sets up options: planes within 4 degrees and 0.1 m are the same, 93 % of the places agree, no prior.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_station_options_init(ptzcal_station_options *options,
                                          size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds the pose between two stations from the planes that both saw. Any number of other planes, and of
 * parallel ones, may be among them.
 *
 * @param station_a The first station's planes.
 * @param station_b The second station's, in any order.
 * @param options   The options; may be NULL: the defaults.
 * @param result    Receives the registration; free it with ptzcal_registration_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEGENERATE for planes that leave a part of the pose
 *         unobservable (the message says which, with directions in station a's or b's frame);
 *         PTZCAL_STATUS_NOT_FOUND when no pose brings three planes in three directions together and
 *         agrees with what the stations saw; PTZCAL_STATUS_AMBIGUOUS when another pose agrees as well,
 *         or when nothing confirms the only one; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_register_stations(const ptzcal_planes *station_a,
                                       const ptzcal_planes *station_b,
                                       const ptzcal_station_options *options,
                                       ptzcal_registration **result,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The pose between two stations from planes that are known to be the same.
 *
 * @param station_a The first station's planes.
 * @param station_b The second station's.
 * @param pairs     n x 2 numbers: a plane of station a, and the same one of station b.
 * @param n         Number of pairs, at least 3.
 * @param result    Receives the registration; free it with ptzcal_registration_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEGENERATE for planes that leave a part of the pose
 *         unobservable (the message says which); PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_register_matched_planes(const ptzcal_planes *station_a,
                                             const ptzcal_planes *station_b,
                                             const uint32_t *pairs,
                                             size_t n,
                                             ptzcal_registration **result,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a registration.
 *
 * @param registration The registration; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_registration_free(ptzcal_registration *registration) PTZCAL_NOEXCEPT;

/**
 * Sets up a pose: the identity.
 *
 * @param pose The struct.
 * @param size sizeof *pose.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_station_pose_init(ptzcal_station_pose *pose,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * The pose.
 *
 * @param registration The registration.
 * @param pose         Receives the pose; set up by ptzcal_station_pose_init.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_registration_get(const ptzcal_registration *registration,
                                      ptzcal_station_pose *pose,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the pairs of planes that are the same: of each pair the number in station a, then in station b.
 *
 * @param registration The registration.
 * @param buffer       Receives 2 numbers for each pair; may be NULL when capacity is 0.
 * @param capacity     Numbers that fit.
 * @param needed       Receives twice the number of pairs; may be NULL.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_registration_copy_matches(const ptzcal_registration *registration,
                                               uint32_t *buffer,
                                               size_t capacity,
                                               size_t *needed,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes the roof edges where the matched planes meet, the same ones in the same order for both stations:
 * for ptzcal_estimate_pose_roof_edges.
 *
 * @param registration The registration.
 * @param station_a    The planes that it was made from.
 * @param station_b    Those of the other station.
 * @param min_angle    Planes that meet at less than this make no edge, radians, 0 to pi/2.
 * @param edges_a      Receives station a's edges; free them with ptzcal_roof_edges_free.
 * @param edges_b      Receives station b's edges; free them with ptzcal_roof_edges_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, also for planes of another registration.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_registration_roof_edges(const ptzcal_registration *registration,
                                             const ptzcal_planes *station_a,
                                             const ptzcal_planes *station_b,
                                             double min_angle,
                                             ptzcal_roof_edges **edges_a,
                                             ptzcal_roof_edges **edges_b,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Devices of the host
 *
 * A host that owns its cameras and its PTZ control hands them in as callbacks. All callbacks of a
 * rig run on the thread that called the library, one at a time, and must not throw or longjmp. Each
 * returns a ptzcal_status: PTZCAL_STATUS_OK, or what went wrong (PTZCAL_STATUS_DEVICE,
 * PTZCAL_STATUS_DEVICE_LOST, PTZCAL_STATUS_DEVICE_TIMEOUT, PTZCAL_STATUS_UNSUPPORTED; any other
 * number counts as PTZCAL_STATUS_DEVICE). A callback that never returns hangs the call that it
 * serves: give it a time-out of its own. `user` is carried along and must live as long as the rig,
 * or the scan, that the callbacks were given to.
 * ============================================================================================= */

/** What a head does at the moment. */
enum {
  /** It stands still. */
  PTZCAL_MOTION_IDLE = 0,
  /** It moves. */
  PTZCAL_MOTION_MOVING = 1,
  /** The last move ended without reaching its target. */
  PTZCAL_MOTION_FAILED = 2,
  /** The device does not say. */
  PTZCAL_MOTION_UNKNOWN = 3,
};
typedef int32_t ptzcal_motion;

/**
 * Starts a move to pan and tilt (radians; positive pan right, positive tilt up) and returns, or
 * returns when the head is there.
 */
typedef int32_t (*ptzcal_ptz_move_fn)(void *user, double pan, double tilt) PTZCAL_CALLBACK_NOEXCEPT;

/** Reads the position: pan and tilt in radians, zoom from 0 (wide) to 1 (tele), 0 without zoom. */
typedef int32_t (*ptzcal_ptz_position_fn)(void *user, double *pan, double *tilt, double *zoom) PTZCAL_CALLBACK_NOEXCEPT;

/** Says whether the head moves: writes a ptzcal_motion. */
typedef int32_t (*ptzcal_ptz_motion_fn)(void *user, int32_t *motion) PTZCAL_CALLBACK_NOEXCEPT;

/** Stops the head at once, in every state. */
typedef int32_t (*ptzcal_ptz_stop_fn)(void *user) PTZCAL_CALLBACK_NOEXCEPT;

/** A pan-tilt head of the host. */
typedef struct ptzcal_ptz {
  /** Set by ptzcal_ptz_init. */
  uint32_t struct_size;
  /**
   * 1: pan and tilt are numbers without known angles, and "radians" below are those numbers; 0: they
   * are radians.
   */
  uint32_t raw_units;
  /** Least pan that the head reaches, radians. */
  double pan_min;
  /** Greatest pan, radians. */
  double pan_max;
  /** Least tilt, radians. */
  double tilt_min;
  /** Greatest tilt, radians. */
  double tilt_max;
  /** Size of an encoder step of pan, radians; 0 when unknown. */
  double pan_step;
  /** Size of an encoder step of tilt, radians; 0 when unknown. */
  double tilt_step;
  /** Handed to the callbacks. */
  void *user;
  /** Required. */
  ptzcal_ptz_move_fn move_absolute;
  /** Required. */
  ptzcal_ptz_position_fn position;
  /** May be NULL: positions and frames then tell whether a move is finished. */
  ptzcal_ptz_motion_fn motion;
  /** Required. */
  ptzcal_ptz_stop_fn stop;
} ptzcal_ptz;

/** Switches the laser: `on` is 1 or 0. */
typedef int32_t (*ptzcal_laser_fn)(void *user, int32_t on) PTZCAL_CALLBACK_NOEXCEPT;

/**
 * Hands over a frame whose exposure began at `not_before` (seconds of the rig's clock) or later,
 * waiting at most `timeout` seconds: PTZCAL_STATUS_DEVICE_TIMEOUT then. `image` is set up; fill in
 * format, size, planes and strides. The pixels must stay until the callback returns and are then
 * copied before anything else is called. `timestamp` receives when the exposure began, on the rig's
 * clock; a source that does not know writes NAN and gives the newest frame: the library then drops
 * some frames after each change.
 */
typedef int32_t (*ptzcal_frame_fn)(void *user,
                                   double not_before,
                                   double timeout,
                                   ptzcal_image *image,
                                   double *timestamp) PTZCAL_CALLBACK_NOEXCEPT;

/** Seconds since any fixed moment; never goes back. The clock that stamps the frames. */
typedef double (*ptzcal_clock_now_fn)(void *user) PTZCAL_CALLBACK_NOEXCEPT;

/** Lets seconds pass on that clock. */
typedef void (*ptzcal_clock_sleep_fn)(void *user, double seconds) PTZCAL_CALLBACK_NOEXCEPT;

/**
 * Sets up a head: no range, no callbacks.
 *
 * @param ptz  The struct.
 * @param size sizeof *ptz.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ptz_init(ptzcal_ptz *ptz, size_t size) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Simulator
 *
 * A rig in a furnished room, for tests and for learning: a head with camera and laser, and fixed
 * cameras, all rendered, with noise, motion, backlash, reflections and a clock of its own that runs
 * as fast as the work is done. A rig opened with the address of a simulator uses one; the functions
 * here also serve as devices for a host that tries out its own callbacks, and tell the truth that
 * results are compared with. Angles are radians, times are seconds of the simulator's clock.
 * ============================================================================================= */

/** The number of the head camera where a camera is asked for; fixed cameras count from 0. */
#define PTZCAL_HEAD_CAMERA 4294967295

/** A simulated rig. The functions may be called from several threads at a time. */
typedef struct ptzcal_simulator ptzcal_simulator;

/**
 * Makes a simulator.
 *
 * @param address   "sim:room", with options behind a question mark: "sim:room?seed=3&station=2".
 *                  An unknown option is refused with a list of the known ones.
 * @param simulator Receives the simulator; free it with ptzcal_simulator_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_new(const char *address,
                                   ptzcal_simulator **simulator,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a simulator. A rig that uses it keeps it alive for itself.
 *
 * @param simulator The simulator; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_simulator_free(ptzcal_simulator *simulator) PTZCAL_NOEXCEPT;

/**
 * What the owner of such a rig would know of it: the truth less a small misalignment.
 *
 * @param simulator The simulator.
 * @param model     Receives the model; set up by ptzcal_rig_model_init.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_nominal_rig(const ptzcal_simulator *simulator,
                                           ptzcal_rig_model *model,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The true rig.
 *
 * @param simulator The simulator.
 * @param model     Receives the model; set up by ptzcal_rig_model_init.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_true_rig(const ptzcal_simulator *simulator,
                                        ptzcal_rig_model *model,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many fixed cameras there are.
 *
 * @param simulator The simulator.
 * @param count     Receives the number.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_fixed_cameras(const ptzcal_simulator *simulator,
                                             size_t *count,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A fixed camera as it truly is, in the rig's frame.
 *
 * @param simulator The simulator.
 * @param index     Which fixed camera, from 0.
 * @param camera    Receives the camera; set up by ptzcal_camera_init.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such camera.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_true_camera(const ptzcal_simulator *simulator,
                                           uint32_t index,
                                           ptzcal_camera *camera,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Where the rig truly stands: X_room = R X_rig + t, the room's frame being that of station 1.
 *
 * @param simulator The simulator.
 * @param pose      Receives rotation, translation and angle; set up by ptzcal_pose_init.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_true_station(const ptzcal_simulator *simulator,
                                            ptzcal_pose *pose,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Moves the simulated head: as a PTZ callback does.
 *
 * @param simulator The simulator.
 * @param pan       Radians.
 * @param tilt      Radians.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE; PTZCAL_STATUS_DEVICE_LOST.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_move(const ptzcal_simulator *simulator,
                                    double pan,
                                    double tilt,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads the simulated head's position.
 *
 * @param simulator The simulator.
 * @param pan       Receives radians.
 * @param tilt      Receives radians.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_position(const ptzcal_simulator *simulator,
                                        double *pan,
                                        double *tilt,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says whether the simulated head moves.
 *
 * @param simulator The simulator.
 * @param motion    Receives a ptzcal_motion.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_motion(const ptzcal_simulator *simulator,
                                      int32_t *motion,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Stops the simulated head.
 *
 * @param simulator The simulator.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_LOST.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_stop(const ptzcal_simulator *simulator,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Switches the simulated laser. What was switched on here goes off when the simulator is freed.
 *
 * @param simulator The simulator.
 * @param on        1 or 0.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_set_laser(const ptzcal_simulator *simulator,
                                         int32_t on,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Waits for a frame of a simulated camera; waiting moves the clock.
 *
 * @param simulator  The simulator.
 * @param camera     A fixed camera from 0, or PTZCAL_HEAD_CAMERA.
 * @param not_before The frame's exposure begins then or later.
 * @param timeout    Longest wait, seconds.
 * @param image      Receives the frame; set up by ptzcal_image_init. Its pixels stay until the next
 *                   call for the same camera, and until the simulator is freed.
 * @param timestamp  Receives when the exposure began.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_TIMEOUT; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_next_frame(const ptzcal_simulator *simulator,
                                          uint32_t camera,
                                          double not_before,
                                          double timeout,
                                          ptzcal_image *image,
                                          double *timestamp,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The simulator's clock.
 *
 * @param simulator The simulator.
 * @param now       Receives seconds.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_now(const ptzcal_simulator *simulator,
                                   double *now,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Lets seconds of the simulator's clock pass, at once.
 *
 * @param simulator The simulator.
 * @param seconds   0 or more.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_simulator_sleep(const ptzcal_simulator *simulator,
                                     double seconds,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Angle maps
 *
 * Some heads count in numbers of their own, such as ONVIF's generic space from -1 to 1, which have no
 * angles. A map says which angles they are. It is learned once (ptzcal_learn_angles), kept in a file,
 * and set in the options of a rig or head, which then speaks radians.
 * ============================================================================================= */

/** Which angles a head's numbers are. Immutable: any number of threads may read it. */
typedef struct ptzcal_angle_map ptzcal_angle_map;

/** What a map covers, and how well it was learned. */
typedef struct ptzcal_angle_summary {
  /** Set by ptzcal_angle_summary_init. */
  uint32_t struct_size;
  /**
   * Pictures that it was learned from; 0: it was made by other means, and the numbers of the learning
   * are 0.
   */
  uint32_t frames;
  /** Pairs of pictures that were matched. */
  uint32_t pairs;
  /** 0. */
  uint32_t reserved;
  /** The device's numbers that are covered: least and greatest pan, least and greatest tilt. */
  double raw[4];
  /** The angles that are covered, radians: least and greatest pan, least and greatest tilt. */
  double angles[4];
  /** How the camera sits on the axes, radians: collimation, roll, trunnion (as a theodolite's). */
  double mounting[3];
  /** Standard deviations of the mounting, radians. */
  double mounting_sigma[3];
  /** Root mean square of the matches' residuals, px. */
  double rms;
  /** Share of the matches that agreed with nothing. */
  double outliers;
  /** How far the head is from the map each time, radians (standard deviation): pan, tilt. */
  double repeatability[2];
  /** Which share of a turn the camera's distance from the axes looks like; 0.01 is 1 degree of 100. */
  double parallax;
  /** Standard deviation of the parallax. */
  double parallax_sigma;
} ptzcal_angle_summary;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_summary_init(ptzcal_angle_summary *summary,
                                        size_t size) PTZCAL_NOEXCEPT;

/**
 * Reads a map's file.
 *
 * @param path  The file.
 * @param map   Receives the map; free it with ptzcal_angle_map_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO, _FILE_FORMAT, _FILE_VERSION.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_map_read(const char *path,
                                    ptzcal_angle_map **map,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a map as JSON, with the residuals of its learning. The file is at every moment the old one
 * or the whole new one.
 *
 * @param map   The map.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_map_save(const ptzcal_angle_map *map,
                                    const char *path,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a map. Options that it was set in keep what they need of it.
 *
 * @param map The map; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_angle_map_free(ptzcal_angle_map *map) PTZCAL_NOEXCEPT;

/**
 * What the map covers, and how well it was learned.
 *
 * @param map     The map.
 * @param summary Receives the summary; set up by ptzcal_angle_summary_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_map_get_summary(const ptzcal_angle_map *map,
                                           ptzcal_angle_summary *summary,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Angles of a head's numbers.
 *
 * @param map        The map.
 * @param raw_pan    The device's number.
 * @param raw_tilt   The device's number.
 * @param pan        Receives radians, positive right.
 * @param tilt       Receives radians, positive up.
 * @param pan_sigma  Receives the standard deviation of pan, radians; may be NULL.
 * @param tilt_sigma Receives the standard deviation of tilt, radians; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE or PTZCAL_STATUS_INVALID_ARGUMENT for numbers that
 *         the map does not cover.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_map_to_angles(const ptzcal_angle_map *map,
                                         double raw_pan,
                                         double raw_tilt,
                                         double *pan,
                                         double *tilt,
                                         double *pan_sigma,
                                         double *tilt_sigma,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A head's numbers of angles.
 *
 * @param map      The map.
 * @param pan      Radians, positive right.
 * @param tilt     Radians, positive up.
 * @param raw_pan  Receives the device's number.
 * @param raw_tilt Receives the device's number.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE or PTZCAL_STATUS_INVALID_ARGUMENT for angles that
 *         the map does not cover.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_map_to_raw(const ptzcal_angle_map *map,
                                      double pan,
                                      double tilt,
                                      double *raw_pan,
                                      double *raw_tilt,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * What a rig is made of
 *
 * Devices by callbacks or by an address, the rig's model, and how it behaves. The options are read
 * when a rig is opened.
 * ============================================================================================= */

/** What a rig is made of, and how it behaves. */
typedef struct ptzcal_rig_options ptzcal_rig_options;

/**
 * Makes options: no devices, defaults for everything else.
 *
 * @param options Receives the options; free them with ptzcal_rig_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_new(ptzcal_rig_options **options,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options. Rigs opened with them live on, and go on using the callbacks.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_rig_options_free(ptzcal_rig_options *options) PTZCAL_NOEXCEPT;

/**
 * Sets the address of a whole rig: the simulator, or a recorded scan. Callbacks and addresses of
 * single devices that are set as well take their place one by one.
 *
 * @param options The options.
 * @param address "sim:room?key=value&..." or "folder:///path"; may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says whether the address exists.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_address(ptzcal_rig_options *options,
                                             const char *address,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the address of the head; a host's head takes its place.
 *
 * @param options The options.
 * @param address Such as "visca:///dev/ttyUSB0?model=evi-d100" (docs/addresses.md); may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_ptz_address(ptzcal_rig_options *options,
                                                 const char *address,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the address of the laser; a host's laser takes its place.
 *
 * @param options The options.
 * @param address Such as "gpio:///dev/gpiochip0/laser" (docs/addresses.md); may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_laser_address(ptzcal_rig_options *options,
                                                   const char *address,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the address of the head camera's frames; a host's frames take its place.
 *
 * @param options The options.
 * @param address Such as "v4l2:///dev/video0?format=YUYV" (docs/addresses.md); may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_frames_address(ptzcal_rig_options *options,
                                                    const char *address,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets which angles the numbers of a head without angles are: the rig refuses such a head without it.
 *
 * @param options The options.
 * @param map     The map, copied; may be NULL: none.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; opening refuses the map for a head that knows angles itself.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_angle_map(ptzcal_rig_options *options,
                                               const ptzcal_angle_map *map,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the greatest share of the time that the laser is on, in any window. Scans pause where they have to.
 *
 * @param options The options.
 * @param duty    More than 0, at most 1; the default is 1: no limit.
 * @param window  Seconds, more than 0, at most 3600; the default is 10.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_laser_duty(ptzcal_rig_options *options,
                                                double duty,
                                                double window,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets who opens the devices that ask for it (ONVIF).
 *
 * @param options  The options.
 * @param user     The user's name; may be NULL: nobody.
 * @param password The password; may be NULL: empty. It is neither logged nor written anywhere.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_credentials(ptzcal_rig_options *options,
                                                 const char *user,
                                                 const char *password,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the rig model. Simulators and recordings bring one of their own; all other rigs need it.
 *
 * @param options The options.
 * @param model   The model.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a model that
 *         makes no sense.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_model(ptzcal_rig_options *options,
                                           const ptzcal_rig_model *model,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the host's head.
 *
 * @param options The options.
 * @param ptz     The head; the struct is copied.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER for a missing callback.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_ptz(ptzcal_rig_options *options,
                                         const ptzcal_ptz *ptz,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the host's laser. ptzcal_rig_emergency_off calls it from its own thread.
 *
 * @param options The options.
 * @param set     Switches the laser.
 * @param user    Handed to the callback.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_laser(ptzcal_rig_options *options,
                                           ptzcal_laser_fn set,
                                           void *user,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the head camera's frames come from.
 *
 * @param options    The options.
 * @param next_frame Hands over a frame.
 * @param user       Handed to the callback.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_frames(ptzcal_rig_options *options,
                                            ptzcal_frame_fn next_frame,
                                            void *user,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the clock that stamps the host's frames. Without one it is the system's monotonic clock,
 * counted from the opening of the rig: frames then need no timestamp (NAN).
 *
 * @param options The options.
 * @param now     Reads the clock.
 * @param sleep   Waits.
 * @param user    Handed to the callbacks.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_clock(ptzcal_rig_options *options,
                                           ptzcal_clock_now_fn now,
                                           ptzcal_clock_sleep_fn sleep,
                                           void *user,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the rig's messages go.
 *
 * @param options  The options.
 * @param callback Receives messages; may be NULL: none are made (the default).
 * @param user     Handed to the callback.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_log(ptzcal_rig_options *options,
                                         ptzcal_log_fn callback,
                                         void *user,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets when a move is finished: the device says so (where it does), some readings in a row are
 * equal, and the head camera's picture stands still.
 *
 * @param options      The options.
 * @param readings     Equal readings in a row, at least 2; the default is 3.
 * @param duration     Seconds that they span; the default is 0.15.
 * @param overshoot    Radians that a move goes past its target first when it comes from the upper
 *                     side, so that every target is approached from below (backlash); the default
 *                     is 0.01, 0 goes straight there.
 * @param move_timeout Longest time for a move, seconds; the default is 30.
 * @param picture      Longest wait for a still picture, seconds; the default is 5, 0 does not look.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening refuses what makes no sense
 *         together.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_settle(ptzcal_rig_options *options,
                                            uint32_t readings,
                                            double duration,
                                            double overshoot,
                                            double move_timeout,
                                            double picture,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how frames are waited for.
 *
 * @param options      The options.
 * @param timeout      Longest wait for a frame, seconds; the default is 3.
 * @param stale_frames Frames without timestamps to drop after each change; the default is 4: the
 *                     depth of the source's buffers and one.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_frame_wait(ptzcal_rig_options *options,
                                                double timeout,
                                                uint32_t stale_frames,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the longest time that the laser stays on. It is enforced whenever the library has control:
 * a callback that does not return keeps it from acting.
 *
 * @param options The options.
 * @param seconds Positive; the default is 2.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_options_set_laser_max_on(ptzcal_rig_options *options,
                                                  double seconds,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * What a head is opened with
 *
 * The head of a camera, to drive it as an operator does: without a rig, a laser, a scan. The options
 * are read when a head is opened.
 * ============================================================================================= */

/** How a move ended. */
enum {
  /** The head stands where it was sent. */
  PTZCAL_MOVE_END_ARRIVED = 0,
  /** It stands elsewhere: at a limit, blocked, or the device gave up. */
  PTZCAL_MOVE_END_MISSED = 1,
  /** It was stopped. */
  PTZCAL_MOVE_END_STOPPED = 2,
  /** A drive was not renewed in time, and was stopped. */
  PTZCAL_MOVE_END_DEAD_MAN = 3,
  /** A later move took its place. */
  PTZCAL_MOVE_END_REPLACED = 4,
  /** The device tells neither its position nor whether it moves. */
  PTZCAL_MOVE_END_UNKNOWN = 5,
  /** The device failed; the status says how. */
  PTZCAL_MOVE_END_FAILED = 6,
};
typedef int32_t ptzcal_move_end;

/** What a head is opened with. */
typedef struct ptzcal_head_options ptzcal_head_options;

/**
 * Hears of the end of a move. It runs on the head's own thread (that of a move which takes another's
 * place: on the caller's), under no lock, and must not throw or longjmp. It may call the head's
 * functions, also ptzcal_head_close.
 *
 * @param user   What was given with the callback.
 * @param number The move's number, from the call that started it.
 * @param end    A ptzcal_move_end.
 * @param status PTZCAL_STATUS_OK, or how the device failed.
 * @param pan    Where the head stands, radians; NAN when that is not known.
 * @param tilt   Where the head stands, radians; NAN when that is not known.
 */
typedef void (*ptzcal_move_end_fn)(void *user,
                                   uint64_t number,
                                   int32_t end,
                                   int32_t status,
                                   double pan,
                                   double tilt) PTZCAL_CALLBACK_NOEXCEPT;

/**
 * Makes options: no device, silent.
 *
 * @param options Receives the options; free them with ptzcal_head_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_new(ptzcal_head_options **options,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options. Heads opened with them live on.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_head_options_free(ptzcal_head_options *options) PTZCAL_NOEXCEPT;

/**
 * Sets the head's address; a host's head takes its place.
 *
 * @param options The options.
 * @param address Such as "visca+udp://camera.lan", "onvif://camera.lan", "sim:room"
 *                (docs/addresses.md); may be NULL: none. It may hold no password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; opening says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_address(ptzcal_head_options *options,
                                              const char *address,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets a head of the host.
 *
 * @param options The options.
 * @param ptz     The head; the struct is copied. Its callbacks run on whatever thread calls, and on
 *                the head's own, one at a time.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER for a missing callback.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_ptz(ptzcal_head_options *options,
                                          const ptzcal_ptz *ptz,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where frames of the camera on the head come from, for ptzcal_probe and ptzcal_learn_angles; a
 * host's frames take their place. A simulator and a recording bring their own.
 *
 * @param options The options.
 * @param address Such as "v4l2:///dev/video0", "onvif://camera.lan"; may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; what opens it says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_frames_address(ptzcal_head_options *options,
                                                     const char *address,
                                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the laser of the head, for ptzcal_probe; a host's takes its place. A simulator brings its own.
 *
 * @param options The options.
 * @param address Such as "gpio:///dev/gpiochip0/laser"; may be NULL: none. It may hold no
 *                password.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; what opens it says what is wrong with it.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_laser_address(ptzcal_head_options *options,
                                                    const char *address,
                                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the host's frames of the camera on the head come from.
 *
 * @param options    The options.
 * @param next_frame Hands over a frame; timestamps are NAN, or seconds of no clock that the library knows.
 * @param user       Handed to the callback.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_frames(ptzcal_head_options *options,
                                             ptzcal_frame_fn next_frame,
                                             void *user,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the host's laser of the head.
 *
 * @param options The options.
 * @param set     Switches the laser.
 * @param user    Handed to the callback.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_laser(ptzcal_head_options *options,
                                            ptzcal_laser_fn set,
                                            void *user,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets which angles the numbers of a head without angles are: it then speaks radians.
 *
 * @param options The options.
 * @param map     The map, copied; may be NULL: none.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; opening refuses the map for a head that knows angles itself.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_angle_map(ptzcal_head_options *options,
                                                const ptzcal_angle_map *map,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets who opens a device that asks for it (ONVIF).
 *
 * @param options  The options.
 * @param user     The user's name; may be NULL: nobody.
 * @param password The password; may be NULL: empty. It is neither logged nor written anywhere.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_credentials(ptzcal_head_options *options,
                                                  const char *user,
                                                  const char *password,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where the head's messages go. They come from its own thread too.
 *
 * @param options  The options.
 * @param callback Receives messages; may be NULL: none are made (the default).
 * @param user     Handed to the callback.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_log(ptzcal_head_options *options,
                                          ptzcal_log_fn callback,
                                          void *user,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets who hears of the ends of moves.
 *
 * @param options  The options.
 * @param callback Hears of each move's end; may be NULL: nobody (the default).
 * @param user     Handed to the callback; it must live until the head is closed.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_options_set_on_move_end(ptzcal_head_options *options,
                                                  ptzcal_move_end_fn callback,
                                                  void *user,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Heads
 *
 * PTZ control as an operator needs it: drive with a joystick, moves in radians, presets, and a stop
 * that waits for nobody. All functions of a head may be called from several threads at once. From
 * its first move on an open head has one thread of its own: it stops a drive that nobody renews, and
 * watches each move until it ends.
 * ============================================================================================= */

/** What a device says of itself. */
enum {
  /** The protocol that it is spoken to with. */
  PTZCAL_IDENTITY_PROTOCOL = 0,
  /** Who made it. */
  PTZCAL_IDENTITY_VENDOR = 1,
  /** Its model. */
  PTZCAL_IDENTITY_MODEL = 2,
  /** Its firmware's version. */
  PTZCAL_IDENTITY_FIRMWARE = 3,
};
typedef uint32_t ptzcal_identity;

/** An open head. */
typedef struct ptzcal_head ptzcal_head;

/** What a head can do. */
typedef struct ptzcal_head_capabilities {
  /** Set by ptzcal_head_capabilities_init. */
  uint32_t struct_size;
  /** 1: the device's pan and tilt are numbers without a known angle. */
  uint32_t raw_units;
  /** Least pan, radians. */
  double pan_min;
  /** Greatest pan, radians. */
  double pan_max;
  /** Least tilt, radians. */
  double tilt_min;
  /** Greatest tilt, radians. */
  double tilt_max;
  /** Size of an encoder step of pan, radians; 0 when unknown. */
  double pan_step;
  /** Size of an encoder step of tilt, radians; 0 when unknown. */
  double tilt_step;
  /** Greatest speed of pan, radians per second; 0 when unknown. */
  double pan_speed;
  /** Greatest speed of tilt, radians per second; 0 when unknown. */
  double tilt_speed;
  /** Number of presets, from 0; 0: none. */
  uint32_t presets;
  /** 1: the device says whether it moves. */
  uint32_t reports_motion;
  /** 1: positions are read from the head; 0: they are where it was sent. */
  uint32_t reports_position;
  /** 1: ptzcal_head_drive works. */
  uint32_t has_drive;
  /** 1: relative moves are the device's own; 0: they are made of absolute ones. */
  uint32_t has_relative;
  /** 1: ptzcal_head_home works. */
  uint32_t has_home;
  /** 1: ptzcal_head_set_zoom works. */
  uint32_t has_zoom;
  /** 1: ptzcal_head_set_focus works. */
  uint32_t has_focus;
  /** 1: ptzcal_head_lock_exposure works. */
  uint32_t has_exposure_lock;
  /** 1: ptzcal_head_move_in_view works. */
  uint32_t has_view_moves;
} ptzcal_head_capabilities;

/**
 * Sets up capabilities: everything 0.
 *
 * @param capabilities The struct.
 * @param size         sizeof *capabilities.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_capabilities_init(ptzcal_head_capabilities *capabilities,
                                            size_t size) PTZCAL_NOEXCEPT;

/**
 * Opens a head: takes it over; it does not move.
 *
 * @param options What it is opened with.
 * @param head    Receives the head; close it with ptzcal_head_close.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT without a device;
 *         PTZCAL_STATUS_INVALID_ADDRESS; PTZCAL_STATUS_UNSUPPORTED for an address of something else;
 *         PTZCAL_STATUS_DEVICE_NOT_FOUND, _PERMISSION, _BUSY, _TIMEOUT, _GARBLED, _MISMATCH,
 *         PTZCAL_STATUS_UNAUTHORISED: what is wrong, with a hint what to do.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_open(const ptzcal_head_options *options,
                               ptzcal_head **head,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Closes a head: stops it, ends its thread, frees the handle. The handle is gone whatever is
 * returned. From inside its callback the thread ends when the callback returns.
 *
 * @param head  The head; may be NULL: nothing happens. No other call may be at work with it.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; the device's own when it could not be stopped.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_close(ptzcal_head *head, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * What the head can do.
 *
 * @param head         The head.
 * @param capabilities Receives them; set up by ptzcal_head_capabilities_init.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_get_capabilities(const ptzcal_head *head,
                                           ptzcal_head_capabilities *capabilities,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * What the device says of itself, as UTF-8 without a NUL.
 *
 * @param head     The head.
 * @param which    A ptzcal_identity.
 * @param buffer   Receives the text; may be NULL when capacity is 0.
 * @param capacity Bytes of the buffer.
 * @param needed   Receives the number of bytes, 0 when the device does not say; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_copy_identity(const ptzcal_head *head,
                                        uint32_t which,
                                        char *buffer,
                                        size_t capacity,
                                        size_t *needed,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads where the head is.
 *
 * @param head  The head.
 * @param pan   Receives the reading, radians.
 * @param tilt  Receives the reading, radians.
 * @param zoom  Receives the zoom, 0 (wide) to 1 (tele), 0 without zoom; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_position(const ptzcal_head *head,
                                   double *pan,
                                   double *tilt,
                                   double *zoom,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says whether the head moves.
 *
 * @param head   The head.
 * @param motion Receives a ptzcal_motion.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_motion(const ptzcal_head *head,
                                 int32_t *motion,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Waits until a move has ended. The end of a move that is long gone is PTZCAL_MOVE_END_REPLACED.
 *
 * @param head        The head.
 * @param move_number The move, from the call that started it.
 * @param timeout     Longest wait, seconds, not negative.
 * @param token       Ends the waiting from another thread, not the move; may be NULL.
 * @param end         Receives a ptzcal_move_end.
 * @param status      Receives PTZCAL_STATUS_OK or how the device failed; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_DEVICE_TIMEOUT: the move goes on; PTZCAL_STATUS_CANCELLED: the same;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a number that no move has.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_wait(const ptzcal_head *head,
                               uint64_t move_number,
                               double timeout,
                               const ptzcal_cancel *token,
                               int32_t *end,
                               int32_t *status,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Driving a head
 *
 * Moves return at once with a number; ptzcal_head_wait waits for their end, and the callback of the
 * options hears of it.
 * ============================================================================================= */

/** How a lens is focused. */
enum {
  /** The camera focuses by itself. */
  PTZCAL_FOCUS_AUTO = 0,
  /** The focus stays where it is. */
  PTZCAL_FOCUS_MANUAL = 1,
  /** The focus goes to a place and stays there. */
  PTZCAL_FOCUS_AT = 2,
};
typedef uint32_t ptzcal_focus;

/**
 * Starts a move and returns. ptzcal_head_wait waits for its end, the callback hears of it.
 *
 * @param head   The head.
 * @param pan    Reading of the device, radians; positive is right.
 * @param tilt   Reading of the device, radians; positive is up.
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range; PTZCAL_STATUS_NOT_FINITE;
 *         a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_move(const ptzcal_head *head,
                               double pan,
                               double tilt,
                               uint64_t *number,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Starts a move from where the head is and returns.
 *
 * @param head   The head.
 * @param pan    Radians; positive is right.
 * @param tilt   Radians; positive is up.
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range; PTZCAL_STATUS_NOT_FINITE;
 *         a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_move_by(const ptzcal_head *head,
                                  double pan,
                                  double tilt,
                                  uint64_t *number,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Starts a move that brings a place of the present picture to its centre, where the device itself can
 * do that (has_view_moves): it needs no known angles and no calibrated lens.
 *
 * @param head   The head.
 * @param x      From the picture's centre, 0, to its right edge, 1, or left edge, -1.
 * @param y      From the picture's centre, 0, to its upper edge, 1, or lower edge, -1.
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT beyond the edges;
 *         PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_move_in_view(const ptzcal_head *head,
                                       double x,
                                       double y,
                                       uint64_t *number,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Drives at a speed until told otherwise, and no longer than dead_man seconds after the last call:
 * a host that hangs, or whose operator is gone, lets go. Call it again in time to go on. All speeds 0
 * stop the head.
 *
 * @param head       The head.
 * @param pan_speed  Radians per second, positive right; cut to what the device can.
 * @param tilt_speed Radians per second, positive up; cut to what the device can.
 * @param zoom_speed -1 (to wide at full speed) to 1 (to tele).
 * @param dead_man   Seconds, more than 0, at most 60.
 * @param number     Receives the move's number; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_UNSUPPORTED by a device without continuous drive; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_drive(const ptzcal_head *head,
                                double pan_speed,
                                double tilt_speed,
                                double zoom_speed,
                                double dead_man,
                                uint64_t *number,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Stops pan, tilt and zoom. It waits neither for an answer of the device nor for another thread's
 * call; where the device cannot be reached beside that call, the stop follows as the call returns.
 *
 * @param head  The head.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; a device's own when it could not be told.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_stop(const ptzcal_head *head, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Starts the move to the device's home position.
 *
 * @param head   The head.
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_home(const ptzcal_head *head,
                               uint64_t *number,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Starts zooming.
 *
 * @param head   The head.
 * @param zoom   0 (wide) to 1 (tele).
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_set_zoom(const ptzcal_head *head,
                                   double zoom,
                                   uint64_t *number,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how the lens is focused.
 *
 * @param head  The head.
 * @param focus A ptzcal_focus.
 * @param at    0 (far) to 1 (near) for PTZCAL_FOCUS_AT; else it is not used, but finite.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_set_focus(const ptzcal_head *head,
                                    uint32_t focus,
                                    double at,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads where the focus is.
 *
 * @param head  The head.
 * @param at    Receives 0 (far) to 1 (near).
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_focus(const ptzcal_head *head,
                                double *at,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Holds exposure and white balance as they are, as taking differences of frames wants it, or lets the
 * camera have them again.
 *
 * @param head   The head.
 * @param locked 1 or 0.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_lock_exposure(const ptzcal_head *head,
                                        uint32_t locked,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Remembers where the head is.
 *
 * @param head   The head.
 * @param preset Which, from 0.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_store_preset(const ptzcal_head *head,
                                       uint32_t preset,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Starts the move to what was remembered.
 *
 * @param head   The head.
 * @param preset Which, from 0.
 * @param number Receives the move's number; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_recall_preset(const ptzcal_head *head,
                                        uint32_t preset,
                                        uint64_t *number,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Forgets a preset.
 *
 * @param head   The head.
 * @param preset Which, from 0.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED; a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_head_clear_preset(const ptzcal_head *head,
                                       uint32_t preset,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Learning angles
 *
 * What the numbers of a head without angles mean is found out by turning its camera over a scene with
 * texture: how far the pictures turn tells the angles. The camera's lens has to be known.
 * ============================================================================================= */

/** How angles are learned. */
typedef struct ptzcal_angle_learning_options {
  /** Set by ptzcal_angle_learning_options_init. */
  uint32_t struct_size;
  /** Least number of positions of an axis, 3 to 256; the default is 7. */
  uint32_t min_positions;
  /** Most pictures, 9 to 1000; the default is 400. */
  uint32_t max_frames;
  /** 0. */
  uint32_t reserved;
  /** Share of the picture by which neighbouring pictures are apart; the default is 0.3. */
  double step;
  /** Nearest distance of what is seen, metres; the default is 2. */
  double scene_nearest;
  /** Farthest distance of what is seen, metres; the default is 100. */
  double scene_farthest;
  /**
   * How far the camera's centre is from the axes, metres, as a rig model's tilt_y, tilt_z, pan_x, pan_z;
   * the default is 0, 0.02, 0, 0.02.
   */
  double levers[4];
  /** Standard deviation of the levers, metres; the default is 0.015. */
  double lever_sigma;
  /** Least share of each axis's range that must be learned; the default is 0.5. */
  double min_cover;
  /** Greatest root mean square of the residuals, px; the default is 2. */
  double max_rms;
} ptzcal_angle_learning_options;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_angle_learning_options_init(ptzcal_angle_learning_options *options,
                                                 size_t size) PTZCAL_NOEXCEPT;

/**
 * Turns a head over its range and learns which angles its numbers are. It takes some minutes. Zoom stays
 * as it is: the camera must be the lens's at this zoom. The head is stopped on every way out that is an
 * error.
 *
 * @param head     The head's options: the head, and its camera's frames.
 * @param camera   The lens of the camera on the head; its pose does not matter.
 * @param options  How; may be NULL: the defaults.
 * @param progress Hears of each picture; may be NULL.
 * @param user     Handed to the callback.
 * @param token    Stops the work from another thread; may be NULL.
 * @param map      Receives the map; free it with ptzcal_angle_map_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND without texture, and when the picture does not turn;
 *         PTZCAL_STATUS_TOO_FEW_POINTS when pictures have too little in common; PTZCAL_STATUS_AMBIGUOUS
 *         for an axis that turns both ways; PTZCAL_STATUS_NO_CONSENSUS for a camera that does not turn
 *         about two axes; PTZCAL_STATUS_DEGENERATE; PTZCAL_STATUS_CANCELLED;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; those of ptzcal_head_open and a device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_learn_angles(const ptzcal_head_options *head,
                                  const ptzcal_camera *camera,
                                  const ptzcal_angle_learning_options *options,
                                  ptzcal_progress_fn progress,
                                  void *user,
                                  const ptzcal_cancel *token,
                                  ptzcal_angle_map **map,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Probing devices
 *
 * What a device really is and does: limits, speeds, repeatability, backlash, latencies, and whether what
 * it reports is true. It is moved a little, and watched.
 * ============================================================================================= */

/** What is measured of a device. */
enum {
  /** Least pan that was reached, as read; with reach_limits. */
  PTZCAL_PROBE_FIGURE_PAN_MIN = 0,
  /** Greatest pan that was reached. */
  PTZCAL_PROBE_FIGURE_PAN_MAX = 1,
  /** Least tilt that was reached. */
  PTZCAL_PROBE_FIGURE_TILT_MIN = 2,
  /** Greatest tilt that was reached. */
  PTZCAL_PROBE_FIGURE_TILT_MAX = 3,
  /** Greatest speed of moves in pan. */
  PTZCAL_PROBE_FIGURE_PAN_SPEED = 4,
  /** Greatest speed of moves in tilt. */
  PTZCAL_PROBE_FIGURE_TILT_SPEED = 5,
  /** From a move's command to the first reading that differs, seconds. */
  PTZCAL_PROBE_FIGURE_START_LATENCY = 6,
  /** How long a call for the position takes, seconds. */
  PTZCAL_PROBE_FIGURE_POSITION_TIME = 7,
  /** 1: readings follow the head; 0: they repeat the command. */
  PTZCAL_PROBE_FIGURE_POSITION_FOLLOWS = 8,
  /** Greatest distance of a settled pan reading from its target. */
  PTZCAL_PROBE_FIGURE_PAN_ERROR = 9,
  /** Greatest distance of a settled tilt reading from its target. */
  PTZCAL_PROBE_FIGURE_TILT_ERROR = 10,
  /** Standard deviation of settled pan readings on returns from one side. */
  PTZCAL_PROBE_FIGURE_PAN_READING_REPEATABILITY = 11,
  /** The same of tilt. */
  PTZCAL_PROBE_FIGURE_TILT_READING_REPEATABILITY = 12,
  /** The same of the picture across, pixels. */
  PTZCAL_PROBE_FIGURE_PAN_REPEATABILITY_PX = 13,
  /** The same of the picture up and down, pixels. */
  PTZCAL_PROBE_FIGURE_TILT_REPEATABILITY_PX = 14,
  /** The same as an angle of pan; with a camera. */
  PTZCAL_PROBE_FIGURE_PAN_REPEATABILITY = 15,
  /** The same as an angle of tilt; with a camera. */
  PTZCAL_PROBE_FIGURE_TILT_REPEATABILITY = 16,
  /**
   * How far the picture is apart when a place is reached from above and from below, pixels; positive
   * when the head lags behind.
   */
  PTZCAL_PROBE_FIGURE_PAN_BACKLASH_PX = 17,
  /** The same of tilt. */
  PTZCAL_PROBE_FIGURE_TILT_BACKLASH_PX = 18,
  /** The same as an angle of pan; with a camera. */
  PTZCAL_PROBE_FIGURE_PAN_BACKLASH = 19,
  /** The same as an angle of tilt; with a camera. */
  PTZCAL_PROBE_FIGURE_TILT_BACKLASH = 20,
  /** Smallest commanded move of pan that the readings show. */
  PTZCAL_PROBE_FIGURE_PAN_SMALLEST_MOVE = 21,
  /** Smallest commanded move of tilt that the readings show. */
  PTZCAL_PROBE_FIGURE_TILT_SMALLEST_MOVE = 22,
  /** How far the head moves on after a stop, by its readings. */
  PTZCAL_PROBE_FIGURE_STOP_DISTANCE = 23,
  /** How long it moves on after a stop, seconds. */
  PTZCAL_PROBE_FIGURE_STOP_TIME = 24,
  /** How long the picture moves on after the device reports arrival, seconds. */
  PTZCAL_PROBE_FIGURE_MOVES_AFTER_ARRIVAL = 25,
  /** 1: the head stands (but for its swing) when the device says so; 0: it does not. */
  PTZCAL_PROBE_FIGURE_ARRIVAL_HONEST = 26,
  /** Time between frames, seconds. */
  PTZCAL_PROBE_FIGURE_FRAME_INTERVAL = 27,
  /** From the start of a frame's exposure to its delivery, seconds. */
  PTZCAL_PROBE_FIGURE_FRAME_AGE = 28,
  /** From a move's command to the delivery of the first frame that shows it, seconds. */
  PTZCAL_PROBE_FIGURE_VISIBLE_AFTER = 29,
  /** The same in frames. */
  PTZCAL_PROBE_FIGURE_VISIBLE_AFTER_FRAMES = 30,
  /** From switching the laser to the delivery of the first frame that shows it, seconds. */
  PTZCAL_PROBE_FIGURE_LASER_VISIBLE_AFTER = 31,
  /** The same in frames. */
  PTZCAL_PROBE_FIGURE_LASER_VISIBLE_AFTER_FRAMES = 32,
  /** How long probing took, seconds. */
  PTZCAL_PROBE_FIGURE_DURATION = 33,
};
typedef uint32_t ptzcal_probe_figure;

/** What was found out about a device. Immutable: any number of threads may read it. */
typedef struct ptzcal_probe_report ptzcal_probe_report;

/** How a device is probed. */
typedef struct ptzcal_probe_options {
  /** Set by ptzcal_probe_options_init. */
  uint32_t struct_size;
  /** Returns to a place from each side, 2 to 100; the default is 5. */
  uint32_t repeats;
  /** 1: go to the four limits of the reported range, too; the default is 0. */
  uint32_t reach_limits;
  /** 1: switch the laser, where the options name one, for a second at most; the default is 0. */
  uint32_t toggle_laser;
  /** Size of the moves, share of each axis's range, 0.005 to 0.4; the default is 0.1. */
  double amplitude;
  /** Longest time, seconds: what is not measured then stays open; the default is 300. */
  double max_time;
} ptzcal_probe_options;

/** A figure that was measured. */
typedef struct ptzcal_figure {
  /** Set by ptzcal_figure_init. */
  uint32_t struct_size;
  /** Measurements that it comes from. */
  uint32_t count;
  /**
   * Radians (the device's own numbers where it knows no angles), radians per second, pixels, seconds,
   * frames; 1 or 0 for yes and no.
   */
  double value;
  /** Its standard deviation. */
  double sigma;
} ptzcal_figure;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_probe_options_init(ptzcal_probe_options *options,
                                        size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a figure: everything 0.
 *
 * @param figure The struct.
 * @param size   sizeof *figure.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_figure_init(ptzcal_figure *figure, size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds out what a device is and does. It takes some minutes at most. The head stays within a part of
 * its range about where it stands (unless the limits are asked for) and comes back; it is stopped on
 * every way out that is an error.
 *
 * @param head    The head's options: the head, and where they are set its camera's frames and its laser.
 * @param camera  Lens of the camera on the head, for angles instead of pixels; may be NULL.
 * @param options How; may be NULL: the defaults.
 * @param token   Stops the work from another thread; may be NULL.
 * @param report  Receives the report; free it with ptzcal_probe_report_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK, also when some figures could not be had: the report says why;
 *         PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_INVALID_ARGUMENT; those of ptzcal_head_open and a
 *         device's own.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_probe(const ptzcal_head_options *head,
                           const ptzcal_camera *camera,
                           const ptzcal_probe_options *options,
                           const ptzcal_cancel *token,
                           ptzcal_probe_report **report,
                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A figure of a report.
 *
 * @param report The report.
 * @param which  A ptzcal_probe_figure.
 * @param figure Receives the figure; set up by ptzcal_figure_init.
 * @param error  Receives the error, whose message says why there is no figure; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when it could not be had;
 *         PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_probe_report_get(const ptzcal_probe_report *report,
                                      uint32_t which,
                                      ptzcal_figure *figure,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The report as text that a person understands, in UTF-8 without a NUL.
 *
 * @param report   The report.
 * @param buffer   Receives the text; may be NULL when capacity is 0.
 * @param capacity Bytes of the buffer.
 * @param needed   Receives the number of bytes; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_probe_report_copy_text(const ptzcal_probe_report *report,
                                            char *buffer,
                                            size_t capacity,
                                            size_t *needed,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a report.
 *
 * @param report The report; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_probe_report_free(ptzcal_probe_report *report) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Rigs
 *
 * A rig is a pan-tilt head with a camera and a laser. It is opened on the host's callbacks or on an
 * address. The laser is off whenever the library is not sure: while the head moves, on every error,
 * when a call is cancelled, and from the moment a rig is closed.
 * ============================================================================================= */

/** An open rig. */
typedef struct ptzcal_rig ptzcal_rig;

/**
 * Opens a rig: takes its devices over and switches the laser off; the head does not move.
 *
 * @param options What the rig is made of.
 * @param rig     Receives the rig; close it with ptzcal_rig_close.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for missing devices, a missing model and
 *         values that make no sense; PTZCAL_STATUS_UNSUPPORTED for an address that this version
 *         does not know; PTZCAL_STATUS_DEVICE and its kin when a device fails.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_open(const ptzcal_rig_options *options,
                              ptzcal_rig **rig,
                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Closes a rig: stops the head, switches the laser off for good, frees the handle. The handle is
 * gone whatever is returned. Also right after an earlier call panicked.
 *
 * @param rig   The rig; may be NULL: nothing happens. No other call may be at work with it.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; the device's own when the head or the laser could not be switched off.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_close(ptzcal_rig *rig, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The rig's model.
 *
 * @param rig   The rig.
 * @param model Receives the model; set up by ptzcal_rig_model_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_get_model(const ptzcal_rig *rig,
                                   ptzcal_rig_model *model,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The simulator behind a rig that was opened with its address: the same room, the same truth.
 *
 * @param rig       The rig.
 * @param simulator Receives the simulator; free it with ptzcal_simulator_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED when there is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_simulator(const ptzcal_rig *rig,
                                   ptzcal_simulator **simulator,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Moves the head and waits until it stands still. The laser is off before it moves.
 *
 * @param rig   The rig.
 * @param pan   Reading of the device, radians; positive is right.
 * @param tilt  Reading of the device, radians; positive is up.
 * @param token Stops the move from another thread; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE outside the head's range;
 *         PTZCAL_STATUS_DEVICE_TIMEOUT when it does not arrive; PTZCAL_STATUS_CANCELLED: the head
 *         was stopped; PTZCAL_STATUS_BUSY; a device's own.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_move(ptzcal_rig *rig,
                              double pan,
                              double tilt,
                              const ptzcal_cancel *token,
                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads where the head is.
 *
 * @param rig   The rig.
 * @param pan   Receives the reading, radians.
 * @param tilt  Receives the reading, radians.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY; a device's own.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_position(ptzcal_rig *rig,
                                  double *pan,
                                  double *tilt,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Turns the head so that the laser hits a point, and waits until it stands still.
 *
 * @param rig   The rig.
 * @param xyz   3 numbers: the point in the rig's world, metres.
 * @param token Stops the move from another thread; may be NULL.
 * @param pan   Receives the reading aimed at, radians; may be NULL.
 * @param tilt  Receives the reading aimed at, radians; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return As ptzcal_rig_move; PTZCAL_STATUS_UNREACHABLE also for points nearer than the laser's
 *         distance from the axes.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_aim_at_point(ptzcal_rig *rig,
                                      const double *xyz,
                                      const ptzcal_cancel *token,
                                      double *pan,
                                      double *tilt,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Turns the head so that the laser hits what the head camera sees now at a pixel.
 *
 * @param rig   The rig.
 * @param u     Pixel in the head camera's image.
 * @param v     Pixel in the head camera's image.
 * @param depth Distance of what is seen along the camera's axis, metres, positive.
 * @param token Stops the move from another thread; may be NULL.
 * @param pan   Receives the reading aimed at, radians; may be NULL.
 * @param tilt  Receives the reading aimed at, radians; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return As ptzcal_rig_aim_at_point.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_aim_at_pixel(ptzcal_rig *rig,
                                      double u,
                                      double v,
                                      double depth,
                                      const ptzcal_cancel *token,
                                      double *pan,
                                      double *tilt,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The readings at which the laser of a rig hits a point, without moving anything.
 *
 * @param model The rig's model.
 * @param xyz   3 numbers: the point in the rig's world, metres.
 * @param pan   Receives the reading, radians; may be NULL.
 * @param tilt  Receives the reading, radians; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a model that makes no sense.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_model_aim(const ptzcal_rig_model *model,
                                   const double *xyz,
                                   double *pan,
                                   double *tilt,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Switches the laser by hand. On is refused while the head moves. It goes off again by itself only
 * when a call on this rig finds that its longest time on is over; the next move switches it off.
 *
 * @param rig   The rig.
 * @param on    1 or 0.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_LASER_REFUSED; PTZCAL_STATUS_BUSY; a device's own.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_set_laser(ptzcal_rig *rig,
                                   int32_t on,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Stops the head and switches the laser off, now. While another thread's call is at work with the
 * rig, that call is cancelled: it stops the head and switches the laser off on its way out. Heads
 * opened by address are stopped beside it at once.
 *
 * @param rig   The rig.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; a device's own when it did not obey.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_stop(const ptzcal_rig *rig, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Switches the laser off and keeps it off until ptzcal_rig_release, from any thread and whatever
 * else is going on. Call it from an interlock, a timer, a button.
 *
 * @param rig   The rig.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; the laser's own when it did not obey: cut its power.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_emergency_off(const ptzcal_rig *rig,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Ends an emergency: the laser may be switched on again.
 *
 * @param rig   The rig.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_LASER_REFUSED when the laser cannot be trusted.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_release(const ptzcal_rig *rig,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * How a region is scanned
 *
 * Options for ptzcal_rig_scan_region, and the fixed cameras that watch.
 * ============================================================================================= */

/** How a region is scanned. */
typedef struct ptzcal_scan_options ptzcal_scan_options;

/**
 * Makes options with their defaults: no fixed cameras, one frame per state, no journal.
 *
 * @param options Receives the options; free them with ptzcal_scan_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_new(ptzcal_scan_options **options,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees options.
 *
 * @param options The options; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_scan_options_free(ptzcal_scan_options *options) PTZCAL_NOEXCEPT;

/**
 * Adds a fixed camera of the host to those that the scan watches.
 *
 * @param options    The options.
 * @param next_frame Hands over a frame, stamped by the rig's clock.
 * @param user       Handed to the callback.
 * @param width      Image size in pixels, 1 to 65536.
 * @param height     Image size in pixels, 1 to 65536.
 * @param index      Receives the camera's number, from 0 in the order of adding; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NULL_POINTER.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_add_camera(ptzcal_scan_options *options,
                                             ptzcal_frame_fn next_frame,
                                             void *user,
                                             uint32_t width,
                                             uint32_t height,
                                             uint32_t *index,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a fixed camera by its address.
 *
 * @param options The options.
 * @param address "sim:fixed/0" or "folder:fixed/0": the first fixed camera of the rig's simulator or
 *                recording; "v4l2://...", "onvif://...": a camera of its own (docs/addresses.md).
 * @param index   Receives the camera's number, from 0 in the order of adding; may be NULL.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_UNSUPPORTED.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_add_camera_address(ptzcal_scan_options *options,
                                                     const char *address,
                                                     uint32_t *index,
                                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says what is known of a watched camera, so that its spots are looked for in the right place from
 * the first shot.
 *
 * @param options The options.
 * @param camera  The camera's number.
 * @param known   The camera, calibrated in the rig's world; may be NULL: nothing is known (the
 *                default).
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_known_camera(ptzcal_scan_options *options,
                                                   uint32_t camera,
                                                   const ptzcal_camera *known,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the lens model with which a watched camera is calibrated between the two passes.
 *
 * @param options The options.
 * @param camera  The camera's number.
 * @param model   A ptzcal_distortion_model; the default is PTZCAL_DISTORTION_MODEL_RADIAL1.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_distortion(ptzcal_scan_options *options,
                                                 uint32_t camera,
                                                 uint32_t model,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how many frames are averaged with the laser off, and with it on.
 *
 * @param options The options.
 * @param frames  1 to 256; the default is 1.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_frames_per_state(ptzcal_scan_options *options,
                                                       uint32_t frames,
                                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets about how many positions the coarse pass takes.
 *
 * @param options The options.
 * @param shots   The default is 80; 0: no coarse pass.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_coarse_shots(ptzcal_scan_options *options,
                                                   uint32_t shots,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Ends a scan once every fixed camera's position is expected to be known well enough, by the covariance
 * of its calibration from the shots so far; the rig is taken as exact. Positions are then visited in
 * eight passes over the region, so that a scan that ends early has covered it. Such a scan is not complete
 * (ptzcal_scan_summary), and ptzcal_scan_end is PTZCAL_STATUS_OK.
 *
 * @param options The options.
 * @param metres  Root mean square error of the position; 0, the default: the whole region is scanned.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a negative one.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_target_accuracy(ptzcal_scan_options *options,
                                                      double metres,
                                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how long a device that is gone (unplugged, switched off) is waited for; the drivers of the
 * library open theirs again when it is back. The laser is off meanwhile.
 *
 * @param options The options.
 * @param seconds 0 to 86400; the default is 0: the scan ends at once, and its journal keeps what it
 *                has.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_reconnect(ptzcal_scan_options *options,
                                                double seconds,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets how spots are found; region and band of the spot options are set by the scan.
 *
 * @param options The options.
 * @param spot    The spot options, copied; may be NULL: the defaults.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_spot(ptzcal_scan_options *options,
                                           const ptzcal_spot_options *spot,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets where spots can be: the depths of the scene, and how far from its predicted place a spot may
 * be.
 *
 * @param options     The options.
 * @param nearest     Metres along the head camera's axis, positive; the default is 0.3.
 * @param farthest    Metres; the default is 100.
 * @param half_width  Half the width of the bands that are searched, pixels; the default is 16: the
 *                    spot with its halo has to fit in.
 * @param model_sigma Standard deviation of the rig model's errors in its images, pixels; the default
 *                    is 1.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; the scan refuses values that make no sense.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_gate(ptzcal_scan_options *options,
                                           double nearest,
                                           double farthest,
                                           double half_width,
                                           double model_sigma,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the journal: each shot is in it before it is reported. When the file is there and belongs to
 * the same scan, the scan goes on from it; a file that is no journal is never touched.
 *
 * @param options The options.
 * @param path    The file; may be NULL: none (the default).
 * @param sync    1: wait for the disk at each shot, so that a power cut loses none either; 0: do not.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_journal(ptzcal_scan_options *options,
                                              const char *path,
                                              int32_t sync,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets a folder where all frames of the scan are written, so that it can be scanned again without the
 * rig: open it as "folder:///path". A scan of the same region by the same rig goes on with what is
 * recorded there already; a folder with anything else in it is never touched. docs/recordings.md
 * tells the format.
 *
 * @param options The options.
 * @param path    The folder; may be NULL: none (the default).
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_recording(ptzcal_scan_options *options,
                                                const char *path,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets the token that stops the scan.
 *
 * @param options The options.
 * @param token   The token; may be NULL: none (the default). It may be freed before the options.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_options_set_cancel(ptzcal_scan_options *options,
                                             const ptzcal_cancel *token,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Scanning a region
 *
 * A scan turns the head over a grid of positions, measures a point with the laser at each, and
 * watches any number of fixed cameras at the same time. It goes over the region twice: a coarse
 * subset of positions tells roughly where each fixed camera stands, and for all others the spot is
 * looked for only where it can be. With a journal, a scan that is killed goes on where it was.
 * ============================================================================================= */

/** What a scan measured. Immutable: any number of threads may read it. */
typedef struct ptzcal_scan ptzcal_scan;

/**
 * The pan and tilt positions of a scan: a grid, both ends included; a single step stands in the
 * middle.
 */
typedef struct ptzcal_region {
  /** Set by ptzcal_region_init. */
  uint32_t struct_size;
  /** Positions of pan, at least 1. */
  uint32_t pan_steps;
  /** Positions of tilt, at least 1. At most 1,000,000 positions in all. */
  uint32_t tilt_steps;
  /** 0. */
  uint32_t reserved;
  /** Least reading of pan, radians. */
  double pan_min;
  /** Greatest reading of pan, radians. */
  double pan_max;
  /** Least reading of tilt, radians. */
  double tilt_min;
  /** Greatest reading of tilt, radians. */
  double tilt_max;
} ptzcal_region;

/** What a scan came to. */
typedef struct ptzcal_scan_summary {
  /** Set by ptzcal_scan_summary_init. */
  uint32_t struct_size;
  /** 1 when every position was visited; ptzcal_scan_end says why not. */
  uint32_t complete;
  /** Positions of the region. */
  uint64_t positions;
  /** Shots taken, those of the journal included. */
  uint64_t shots;
  /** Shots read from the journal. */
  uint64_t resumed;
  /** Shots whose spot the head camera saw. */
  uint64_t found;
  /** Fixed cameras watched. */
  uint64_t fixed_cameras;
  /** Records of the journal that were damaged; their positions were measured again. */
  uint64_t journal_damaged;
  /** Bytes of an unfinished record that were cut off the journal's end. */
  uint64_t journal_cut;
} ptzcal_scan_summary;

/**
 * Sets up a region: one position, straight ahead.
 *
 * @param region The struct.
 * @param size   sizeof *region.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_region_init(ptzcal_region *region, size_t size) PTZCAL_NOEXCEPT;

/**
 * The region that a recorded scan covers, of a rig that was opened on a recording's folder.
 *
 * @param rig    The rig.
 * @param region Receives the region; set up by ptzcal_region_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for any other rig.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_recorded_region(const ptzcal_rig *rig,
                                         ptzcal_region *region,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_summary_init(ptzcal_scan_summary *summary,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Scans a region. A scan that ends early (stopped by the callback, cancelled, a device or the
 * journal failed) still returns what it measured: PTZCAL_STATUS_OK with a scan that is not
 * complete, and ptzcal_scan_end says why. However it ends, the laser is off and the head was told to
 * stop.
 *
 * @param rig      The rig.
 * @param region   The positions.
 * @param options  The options; may be NULL: the defaults, without fixed cameras.
 * @param progress Hears of each shot and can stop the scan; may be NULL.
 * @param user     Handed to the callback.
 * @param scan     Receives the scan; free it with ptzcal_scan_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; and before anything moves PTZCAL_STATUS_INVALID_ARGUMENT,
 *         PTZCAL_STATUS_UNREACHABLE for a region out of the head's reach, PTZCAL_STATUS_FILE_IO and
 *         its kin for the journal, PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_scan_region(ptzcal_rig *rig,
                                     const ptzcal_region *region,
                                     const ptzcal_scan_options *options,
                                     ptzcal_progress_fn progress,
                                     void *user,
                                     ptzcal_scan **scan,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a scan.
 *
 * @param scan The scan; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_scan_free(ptzcal_scan *scan) PTZCAL_NOEXCEPT;

/**
 * What a scan came to.
 *
 * @param scan    The scan.
 * @param summary Receives the summary; set up by ptzcal_scan_summary_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_get_summary(const ptzcal_scan *scan,
                                      ptzcal_scan_summary *summary,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Image size of a fixed camera of a scan: what ptzcal_correspondences_new wants.
 *
 * @param scan   The scan.
 * @param camera The fixed camera's number.
 * @param width  Receives its width, pixels.
 * @param height Receives its height, pixels.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera that was not watched.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_camera_size(const ptzcal_scan *scan,
                                      uint32_t camera,
                                      uint32_t *width,
                                      uint32_t *height,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How a scan ended: fails with the reason when it ended before its time.
 *
 * @param scan  The scan.
 * @param error Receives the reason; may be NULL.
 * @return PTZCAL_STATUS_OK for a complete scan, and for one that met its target accuracy before
 *         (ptzcal_scan_options_set_target_accuracy); PTZCAL_STATUS_CANCELLED when it was stopped or
 *         cancelled; the status of the device or file that failed.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_end(const ptzcal_scan *scan, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A shot of a scan, in the order in which they were taken.
 *
 * @param scan  The scan.
 * @param index From 0 to the number of shots less 1.
 * @param shot  Receives the shot; set up by ptzcal_shot_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such shot.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_get_shot(const ptzcal_scan *scan,
                                   size_t index,
                                   ptzcal_shot *shot,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Where a camera saw the spot of a shot.
 *
 * @param scan   The scan.
 * @param index  The shot.
 * @param camera A fixed camera's number, or PTZCAL_HEAD_CAMERA.
 * @param spot   Receives the spot; set up by ptzcal_spot_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND or PTZCAL_STATUS_AMBIGUOUS when the camera has no
 *         spot for this shot (the message says why); PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_get_spot(const ptzcal_scan *scan,
                                   size_t index,
                                   uint32_t camera,
                                   ptzcal_spot *spot,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the measured points, in the order of the shots; shots without a point are left out.
 *
 * @param scan     The scan.
 * @param xyz      Receives 3 numbers a point, metres; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_copy_points(const ptzcal_scan *scan,
                                      double *xyz,
                                      size_t capacity,
                                      size_t *needed,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds to a set what the head camera and a fixed camera saw together: the calibration of that
 * camera from this scan.
 *
 * @param set    The set, for the camera's image size.
 * @param scan   The scan.
 * @param camera The fixed camera's number.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera that was not watched or has
 *         another image size; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_scan(ptzcal_correspondences *set,
                                              const ptzcal_scan *scan,
                                              uint32_t camera,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a plane fitted to the shots of a scan within a range of readings: the scan of a region that
 * shows one plane, or a part of it that does.
 *
 * @param edges  The set.
 * @param scan   The scan.
 * @param region The range of readings; its steps do not matter; may be NULL: all shots.
 * @param plane  Receives the plane's number in the set.
 * @param error  Receives the error; may be NULL.
 * @return As ptzcal_roof_edges_add_plane_shots.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_roof_edges_add_plane_scan(ptzcal_roof_edges *edges,
                                               const ptzcal_scan *scan,
                                               const ptzcal_region *region,
                                               uint32_t *plane,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Planes of a scan
 *
 * A scan as it is: its shots need not be copied. The frame is the rig's. Labels (ptzcal_planes_copy_labels)
 * are those of the scan's shots, in their order; a shot that measured no depth has -1.
 * ============================================================================================= */

/**
 * Finds the planes that a scan shows.
 *
 * @param scan    The scan.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FOUND when there is no plane;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_find_scan(const ptzcal_scan *scan,
                                      const ptzcal_planes_options *options,
                                      ptzcal_planes **planes,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fits one plane to the shots of a scan whose readings lie in a range, for each of several ranges. Up to half
 * of them may have hit something else.
 *
 * @param scan     The scan.
 * @param readings 4 numbers a region: least and greatest pan, least and greatest tilt, radians, ends included.
 * @param regions  Number of regions, 1 to 1000.
 * @param options  The options; may be NULL: the defaults.
 * @param planes   Receives the planes, in the order of the regions; free them with ptzcal_planes_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         rig; PTZCAL_STATUS_INVALID_ARGUMENT, also for a range that ends before it begins;
 *         PTZCAL_STATUS_NOT_FINITE. The error's index is the region's number.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_scan(const ptzcal_scan *scan,
                                     const double *readings,
                                     uint32_t regions,
                                     const ptzcal_planes_options *options,
                                     ptzcal_planes **planes,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fits one plane to the shots of a scan that hit something in a box, for each of several boxes. Up to half of
 * them may have hit something else.
 *
 * @param scan    The scan.
 * @param boxes   6 numbers a region: least x, y, z of a box, then greatest, metres, in the rig's frame.
 * @param regions Number of boxes, 1 to 1000.
 * @param options The options; may be NULL: the defaults.
 * @param planes  Receives the planes, in the order of the boxes; free them with ptzcal_planes_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NO_CONSENSUS when half of a region
 *         is on no plane; PTZCAL_STATUS_DEGENERATE for a region on one line or a plane through the
 *         rig; PTZCAL_STATUS_INVALID_ARGUMENT, also for a box without inside;
 *         PTZCAL_STATUS_NOT_FINITE. The error's index is the box's number.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_planes_fit_scan_in_boxes(const ptzcal_scan *scan,
                                              const double *boxes,
                                              uint32_t regions,
                                              const ptzcal_planes_options *options,
                                              ptzcal_planes **planes,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Clouds
 *
 * Coloured points of the world, with what is known of their noise: from a scan, from a depth map, from
 * a file, or added one list after the other. Clouds of several stations are moved into one frame and
 * merged; clouds that are too fine are thinned. At most 50,000,000 points.
 * ============================================================================================= */

/** What is known of the noise of a cloud's points. */
enum {
  PTZCAL_CLOUD_NOISE_UNKNOWN = 0,
  /** The root mean square distance of each point from its truth. */
  PTZCAL_CLOUD_NOISE_DEVIATIONS = 1,
  /** The covariance of each point. */
  PTZCAL_CLOUD_NOISE_COVARIANCES = 2,
};
typedef uint32_t ptzcal_cloud_noise;

/** Points of the world. */
typedef struct ptzcal_cloud ptzcal_cloud;

/**
 * Makes a cloud without points.
 *
 * @param cloud Receives the cloud; free it with ptzcal_cloud_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_new(ptzcal_cloud **cloud, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The points that a scan measured with its head camera, with colours and covariances, which are those
 * of the spots' noise: rank one, along the laser's line.
 *
 * @param scan  The scan.
 * @param cloud Receives the cloud; free it with ptzcal_cloud_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_from_scan(const ptzcal_scan *scan,
                                     ptzcal_cloud **cloud,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The points of a depth map's pixels, in the world of its camera's pose, with covariances.
 *
 * @param map                 The map.
 * @param camera              Its camera, of the same size.
 * @param image               The camera's picture, of the same size, for the colours; may be NULL: white.
 * @param inverse_depth_sigma Standard deviation of inverse depths, 1/m: for cameras that triangulate.
 *                            0.001425 is a Kinect's of the first kind.
 * @param depth_sigma         Standard deviation of depths besides, metres: for times of flight. Not
 *                            both are 0.
 * @param cloud               Receives the cloud; free it with ptzcal_cloud_free.
 * @param error               Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for sizes that differ;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL for the image.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_from_depth_map(const ptzcal_depth_map *map,
                                          const ptzcal_camera *camera,
                                          const ptzcal_image *image,
                                          double inverse_depth_sigma,
                                          double depth_sigma,
                                          ptzcal_cloud **cloud,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a cloud.
 *
 * @param cloud The cloud; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_cloud_free(ptzcal_cloud *cloud) PTZCAL_NOEXCEPT;

/**
 * Adds points: all of them, or none.
 *
 * @param cloud       The cloud.
 * @param xyz         n x 3 numbers: x, y, z, metres.
 * @param rgb         n x 3 bytes: red, green, blue; may be NULL: white.
 * @param covariances n x 6 numbers: xx, xy, xz, yy, yz, zz, m^2; may be NULL: unknown.
 * @param n           Number of points.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE, with the index of the point;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none, for covariances where the
 *         cloud's other points have none or the other way round, and for too many points;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_add_points(ptzcal_cloud *cloud,
                                      const double *xyz,
                                      const uint8_t *rgb,
                                      const double *covariances,
                                      size_t n,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds another cloud's points: all of them, or none. Deviations become covariances where the other
 * cloud has those.
 *
 * @param cloud The cloud.
 * @param other Another cloud.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when only one of the two knows its noise or
 *         has normals, which would be lost, and for too many points; PTZCAL_STATUS_BUSY, also for a
 *         cloud merged with itself.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_merge(ptzcal_cloud *cloud,
                                 const ptzcal_cloud *other,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Forgets what is known of the noise and the normals, so that the cloud can be merged with one that
 * does not know them.
 *
 * @param cloud The cloud.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_strip(ptzcal_cloud *cloud, ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Moves a cloud: X <- R X + t, with its normals and covariances.
 *
 * @param cloud      The cloud.
 * @param pose       R and t; of station b in station a's frame it takes a cloud of b into a's frame.
 * @param covariance 36 numbers: the pose's covariance as ptzcal_pose_estimate_copy_covariance gives it,
 *                   of the rotation vector in R <- exp([w]x) R (radians), then of t (metres). What the
 *                   pose's error does to each point is added to its covariance; may be NULL: none.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for what is no
 *         rotation or no covariance; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_transform(ptzcal_cloud *cloud,
                                     const ptzcal_pose *pose,
                                     const double *covariance,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Keeps the points inside a box, its faces included.
 *
 * @param cloud    The cloud.
 * @param least    3 numbers: least x, y, z, metres.
 * @param greatest 3 numbers: greatest x, y, z, metres.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a least
 *         coordinate above the greatest; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_crop(ptzcal_cloud *cloud,
                                const double *least,
                                const double *greatest,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Thins a cloud out: the points in each cube of a grid through the origin become one, the mean weighted
 * by what is known of their noise, with the mean of their colours and the covariance of the mean.
 *
 * @param cloud The cloud.
 * @param voxel Side of the cubes, metres.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a size that is
 *         not positive, or so small that the cloud has more than 2^21 cubes along a side;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_thin(ptzcal_cloud *cloud,
                                double voxel,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many points a cloud has, and what is known of them.
 *
 * @param cloud   The cloud.
 * @param points  Receives the number of points; may be NULL.
 * @param noise   Receives a ptzcal_cloud_noise; may be NULL.
 * @param normals Receives 1 where there are normals, else 0; may be NULL.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_size(const ptzcal_cloud *cloud,
                                size_t *points,
                                uint32_t *noise,
                                uint32_t *normals,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * What is in a cloud
 *
 * Its numbers, its files, and what a camera sees of it.
 * ============================================================================================= */

/**
 * Copies the points: n x 3 numbers, x, y, z, metres.
 *
 * @param cloud    The cloud.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_copy_points(const ptzcal_cloud *cloud,
                                       double *buffer,
                                       size_t capacity,
                                       size_t *needed,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the colours: n x 3 bytes, red, green, blue.
 *
 * @param cloud    The cloud.
 * @param buffer   Receives the bytes; may be NULL when `capacity` is 0.
 * @param capacity Bytes that fit into `buffer`.
 * @param needed   Receives how many bytes there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_copy_colours(const ptzcal_cloud *cloud,
                                        uint8_t *buffer,
                                        size_t capacity,
                                        size_t *needed,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the normals: n x 3 numbers, unit vectors out of the surface, zeros where there is none.
 *
 * @param cloud    The cloud.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE for a cloud without
 *         normals; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_copy_normals(const ptzcal_cloud *cloud,
                                        double *buffer,
                                        size_t capacity,
                                        size_t *needed,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the standard deviations: n numbers, metres, the root mean square distance of each point from
 * its truth, which is the root of its covariance's trace.
 *
 * @param cloud    The cloud.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where the noise is
 *         unknown; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_copy_deviations(const ptzcal_cloud *cloud,
                                           double *buffer,
                                           size_t capacity,
                                           size_t *needed,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the covariances: n x 6 numbers, xx, xy, xz, yy, yz, zz, m^2.
 *
 * @param cloud    The cloud.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BAD_STATE where they are
 *         unknown; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_copy_covariances(const ptzcal_cloud *cloud,
                                            double *buffer,
                                            size_t capacity,
                                            size_t *needed,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a cloud, in the format that the file's ending names: .ply, .pcd (both binary, with normals and
 * noise), .glb (glTF 2.0, with normals and noise) or .wrl (VRML97).
 *
 * @param cloud The cloud.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending; PTZCAL_STATUS_FILE_IO;
 *         PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_save(const ptzcal_cloud *cloud,
                                const char *path,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads a cloud: .ply, .pcd, .glb or .wrl, ours or another's; of a mesh its vertices.
 *
 * @param path    The file.
 * @param cloud   Receives the cloud; free it with ptzcal_cloud_free.
 * @param skipped Receives how many points were left out because a coordinate is NaN or infinite, as
 *                depth cameras mark what they did not measure; may be NULL.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending, and for more than 50,000,000
 *         points; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_load(const char *path,
                                ptzcal_cloud **cloud,
                                size_t *skipped,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Depths of the points in a camera's image, lens distortion included: the nearest one in each pixel,
 * with its variance where the noise is known. Between the points there is no depth; a surface
 * (ptzcal_mesh_depth_map) has no gaps.
 *
 * @param cloud  The cloud.
 * @param camera The camera, of at most 2^25 pixels.
 * @param map    Receives the map; free it with ptzcal_depth_map_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_cloud_depth_map(const ptzcal_cloud *cloud,
                                     const ptzcal_camera *camera,
                                     ptzcal_depth_map **map,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Meshes
 *
 * A textured surface, the 3D model of a scene: triangulated from a scan's grid of positions or from a
 * depth map, covered with pictures of calibrated cameras, and written as glTF or VRML.
 * ============================================================================================= */

/** Triangles between points, with pictures on them. */
typedef struct ptzcal_mesh ptzcal_mesh;

/**
 * When neighbours of a grid are one surface. Neighbours are not joined where the depth jumps: where an
 * edge is steeper than max_incidence by more than the noise of its ends, and where neither the surface
 * before it nor the one behind it, extended, explains it.
 */
typedef struct ptzcal_surface_options {
  /** Set by ptzcal_surface_options_init. */
  uint32_t struct_size;
  /** 0. */
  uint32_t reserved;
  /**
   * Angle between ray and normal, radians, up to which a surface needs no support from its
   * neighbours: above 0 and below pi / 2.
   */
  double max_incidence;
  /** Standard deviations beyond which a difference is not noise. */
  double significance;
} ptzcal_surface_options;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_surface_options_init(ptzcal_surface_options *options,
                                          size_t size) PTZCAL_NOEXCEPT;

/**
 * Makes a mesh of given triangles.
 *
 * @param vertices  The points; the mesh has a copy.
 * @param triangles n x 3 numbers of points, counter-clockwise for who sees the front.
 * @param n         Number of triangles.
 * @param mesh      Receives the mesh; free it with ptzcal_mesh_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a number that is no point's;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_new(const ptzcal_cloud *vertices,
                              const uint32_t *triangles,
                              size_t n,
                              ptzcal_mesh **mesh,
                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The surface through the points of a scan, on the grid of its region, with colours, normals and
 * covariances. Shots without a point are holes; the front is where the rig stood.
 *
 * @param scan    The scan.
 * @param options The options; may be NULL: the defaults.
 * @param mesh    Receives the mesh; free it with ptzcal_mesh_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_from_scan(const ptzcal_scan *scan,
                                    const ptzcal_surface_options *options,
                                    ptzcal_mesh **mesh,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The surface that a depth map shows, in the world of its camera's pose.
 *
 * @param map                 The map.
 * @param camera              Its camera, of the same size.
 * @param image               The camera's picture, of the same size, for the colours; may be NULL: white.
 * @param inverse_depth_sigma Standard deviation of inverse depths, 1/m.
 * @param depth_sigma         Standard deviation of depths besides, metres. Not both are 0.
 * @param options             The options; may be NULL: the defaults.
 * @param mesh                Receives the mesh; free it with ptzcal_mesh_free.
 * @param error               Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for sizes that differ;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL for the image.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_from_depth_map(const ptzcal_depth_map *map,
                                         const ptzcal_camera *camera,
                                         const ptzcal_image *image,
                                         double inverse_depth_sigma,
                                         double depth_sigma,
                                         const ptzcal_surface_options *options,
                                         ptzcal_mesh **mesh,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a mesh.
 *
 * @param mesh The mesh; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_mesh_free(ptzcal_mesh *mesh) PTZCAL_NOEXCEPT;

/**
 * Gives a mesh a picture for its textures; ptzcal_mesh_texture puts it on.
 *
 * @param mesh   The mesh.
 * @param image  The picture; the mesh has a copy.
 * @param camera Where it was taken from: a camera of the picture's size.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a malformed image, sizes that differ, and
 *         more than 256 pictures; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_add_picture(ptzcal_mesh *mesh,
                                      const ptzcal_image *image,
                                      const ptzcal_camera *camera,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Covers a mesh with the pictures added to it: each triangle gets the picture that shows its whole
 * front, unhidden, with the most pixels. Triangles that no picture shows keep their points' colours.
 *
 * @param mesh    The mesh.
 * @param covered Receives the number of triangles with a picture; may be NULL.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera of more than 2^25 pixels;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_texture(ptzcal_mesh *mesh,
                                  size_t *covered,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How large a mesh is.
 *
 * @param mesh      The mesh.
 * @param vertices  Receives the number of points; may be NULL.
 * @param triangles Receives the number of triangles; may be NULL.
 * @param textures  Receives the number of pictures on it; may be NULL.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_size(const ptzcal_mesh *mesh,
                               size_t *vertices,
                               size_t *triangles,
                               size_t *textures,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A copy of a mesh's points, with their colours, normals and noise.
 *
 * @param mesh  The mesh.
 * @param cloud Receives the cloud; free it with ptzcal_cloud_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_vertices(const ptzcal_mesh *mesh,
                                   ptzcal_cloud **cloud,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the triangles: n x 3 numbers of points, counter-clockwise for who sees the front.
 *
 * @param mesh     The mesh.
 * @param buffer   Receives the numbers; may be NULL when `capacity` is 0.
 * @param capacity Numbers that fit into `buffer`.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_copy_triangles(const ptzcal_mesh *mesh,
                                         uint32_t *buffer,
                                         size_t capacity,
                                         size_t *needed,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a mesh, in the format that the file's ending names: .glb (glTF 2.0, with everything), .wrl
 * (VRML97, with its pictures, without normals and noise) or .ply (without its pictures).
 *
 * @param mesh  The mesh.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending; PTZCAL_STATUS_FILE_IO;
 *         PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_save(const ptzcal_mesh *mesh,
                               const char *path,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads a mesh: .glb, .wrl or .ply, ours or another's.
 *
 * @param path  The file.
 * @param mesh  Receives the mesh; free it with ptzcal_mesh_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNSUPPORTED for another ending, for what such a file may have
 *         and this library does not read, and for more than 50,000,000 points or triangles;
 *         PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_load(const char *path,
                               ptzcal_mesh **mesh,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Depths of a surface in a camera's image, exact at the centre of every pixel whatever the lens; both
 * sides of the surface are seen. Where there is no surface there is no depth. The variances are those
 * of the triangles' planes, from the noise of the points.
 *
 * @param mesh   The mesh.
 * @param camera The camera, of at most 2^25 pixels.
 * @param map    Receives the map; free it with ptzcal_depth_map_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_mesh_depth_map(const ptzcal_mesh *mesh,
                                    const ptzcal_camera *camera,
                                    ptzcal_depth_map **map,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Exploring
 *
 * Finds by itself the range of pan and tilt in which each fixed camera sees the laser's spot, coarse to
 * fine; and fires single shots again where a scan has measured before.
 * ============================================================================================= */

/** Where fixed cameras see the laser's spot. Immutable: any number of threads may read it. */
typedef struct ptzcal_exploration ptzcal_exploration;

/** How the head's reach is explored. */
typedef struct ptzcal_explore_options {
  /** Set by ptzcal_explore_options_init. */
  uint32_t struct_size;
  /** Most shots, 4 to 500. */
  uint32_t max_shots;
  /** 0. */
  uint32_t reserved[2];
  /** Least reading of pan to look at, radians; -INFINITY: as far as the head reaches. */
  double pan_min;
  /** Greatest reading of pan, radians; INFINITY likewise. */
  double pan_max;
  /** Least reading of tilt, radians; -INFINITY likewise. */
  double tilt_min;
  /** Greatest reading of tilt, radians; INFINITY likewise. */
  double tilt_max;
  /** Shots are no nearer to each other than this, 0.01 to 1 radians. */
  double tolerance;
  /** Steps of the regions that come out, radians. */
  double spacing;
} ptzcal_explore_options;

/** Where a fixed camera sees the spot. */
typedef struct ptzcal_visible {
  /** Set by ptzcal_visible_init. */
  uint32_t struct_size;
  /** Shots taken in all. */
  uint32_t shots;
  /** Shots that the camera saw. */
  uint32_t seen;
  /** Of them those that the head camera saw too. */
  uint32_t measured;
  /** Part of the region's positions that the camera sees, as far as the shots tell. */
  double share;
} ptzcal_visible;

/**
 * Sets up options: all that the head reaches, at most 59 shots, to 2.5 degrees, steps of 1 degree.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_explore_options_init(ptzcal_explore_options *options,
                                          size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a result: everything 0.
 *
 * @param visible The struct.
 * @param size    sizeof *visible.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_visible_init(ptzcal_visible *visible, size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds the range of pan and tilt in which each fixed camera sees the laser's spot. What ends early
 * (stopped, cancelled, a device failed) is PTZCAL_STATUS_OK with what was found until then:
 * ptzcal_scan_end of ptzcal_exploration_get_scan says why. However it ends, the laser is off and the head
 * was told to stop.
 *
 * @param rig          The rig.
 * @param options      The options; may be NULL: the defaults.
 * @param scan_options How shots are taken and which fixed cameras watch; journal, recording and coarse
 *                     pass do not matter.
 * @param progress     Hears of each shot and can stop the work; may be NULL.
 * @param user         Handed to the callback.
 * @param exploration  Receives the answer; free it with ptzcal_exploration_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND: no camera saw a spot; and before anything moves
 *         PTZCAL_STATUS_INVALID_ARGUMENT, PTZCAL_STATUS_NOT_FINITE, PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_explore(ptzcal_rig *rig,
                                 const ptzcal_explore_options *options,
                                 const ptzcal_scan_options *scan_options,
                                 ptzcal_progress_fn progress,
                                 void *user,
                                 ptzcal_exploration **exploration,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees an exploration.
 *
 * @param exploration The exploration; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_exploration_free(ptzcal_exploration *exploration) PTZCAL_NOEXCEPT;

/**
 * Where a fixed camera sees the spot.
 *
 * @param exploration The exploration.
 * @param camera      The fixed camera's number.
 * @param region      Receives the range, ready for ptzcal_rig_scan_region; set up by
 *                    ptzcal_region_init.
 * @param visible     Receives how much of it is seen; set up by ptzcal_visible_init.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND: the camera saw none;
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a camera that did not watch.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_exploration_get_visible(const ptzcal_exploration *exploration,
                                             uint32_t camera,
                                             ptzcal_region *region,
                                             ptzcal_visible *visible,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * For each position of the region, tilt step * pan_steps + pan step: 1 when the camera sees the spot there,
 * as far as the shots about it tell, else 0.
 *
 * @param exploration The exploration.
 * @param camera      The fixed camera's number.
 * @param buffer      Receives the bytes; may be NULL when capacity is 0.
 * @param capacity    How many bytes the buffer holds.
 * @param needed      Receives how many there are, also when they do not fit; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return As ptzcal_exploration_get_visible; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_exploration_copy_mask(const ptzcal_exploration *exploration,
                                           uint32_t camera,
                                           uint8_t *buffer,
                                           size_t capacity,
                                           size_t *needed,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The shots of an exploration, and how it ended, as a scan.
 *
 * @param exploration The exploration.
 * @param scan        Receives a scan of its own; free it with ptzcal_scan_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_exploration_get_scan(const ptzcal_exploration *exploration,
                                          ptzcal_scan **scan,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Fires single shots again at the readings of an earlier scan's, for ptzcal_health_check. A work that
 * ends early returns what it measured; ptzcal_scan_end says why. However it ends, the laser is off and the
 * head was told to stop.
 *
 * @param rig          The rig.
 * @param before       The earlier scan.
 * @param indices      n indices of its shots, as ptzcal_scan_choose_health_shots gives them.
 * @param n            Number of shots, at least 1.
 * @param scan_options How shots are taken and which fixed cameras watch; journal, recording and coarse
 *                     pass do not matter.
 * @param progress     Hears of each shot and can stop the work; may be NULL.
 * @param user         Handed to the callback.
 * @param again        Receives the shots, in this order; free it with ptzcal_scan_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; and before anything moves PTZCAL_STATUS_INVALID_ARGUMENT (an index that
 *         does not exist), PTZCAL_STATUS_UNREACHABLE, PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_rig_fire_again(ptzcal_rig *rig,
                                    const ptzcal_scan *before,
                                    const size_t *indices,
                                    size_t n,
                                    const ptzcal_scan_options *scan_options,
                                    ptzcal_progress_fn progress,
                                    void *user,
                                    ptzcal_scan **again,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Health check
 *
 * Ten stored shots fired again (ptzcal_rig_fire_again) say whether a fixed camera still is where it was
 * calibrated: unchanged, moved (and where to), a rig that moved, or that it cannot be told; with the
 * test statistic and a false alarm rate that is chosen.
 * ============================================================================================= */

/** What a check says. */
enum {
  PTZCAL_VERDICT_UNCHANGED = 0,
  /**
   * The fixed camera was turned or moved; its pose is refitted. One camera cannot tell that from a rig
   * that was moved where the laser still meets the same depths: with several cameras, all of them
   * say so then.
   */
  PTZCAL_VERDICT_CAMERA_MOVED = 1,
  /** The rig was moved, its head has lost its zero, or its laser has moved on the head. */
  PTZCAL_VERDICT_RIG_MOVED = 2,
  /** Too few spots, or nothing explains them, or more than one thing does. */
  PTZCAL_VERDICT_CANNOT_TELL = 3,
};
typedef int32_t ptzcal_verdict;

/** What became of a shot. */
enum {
  PTZCAL_SHOT_STATE_USED = 0,
  /** The head camera, the fixed camera or both do not see its spot again. */
  PTZCAL_SHOT_STATE_NOT_SEEN = 1,
  /** The laser meets something else there now. */
  PTZCAL_SHOT_STATE_SCENE_CHANGED = 2,
  /** The fixed camera's spot contradicts all others. */
  PTZCAL_SHOT_STATE_OUTLIER = 3,
};
typedef int32_t ptzcal_shot_state;

/** The answer of a check. Immutable: any number of threads may read it. */
typedef struct ptzcal_health_report ptzcal_health_report;

/** How a check decides. */
typedef struct ptzcal_health_options {
  /** Set by ptzcal_health_options_init. */
  uint32_t struct_size;
  /** 0. */
  uint32_t reserved;
  /** Probability of not saying unchanged when nothing has changed, between 0 and 0.5. */
  double false_alarm;
  /** Standard deviation of where the head comes to rest about its reading of pan, radians. */
  double pan_sigma;
  /** The same of tilt, radians. */
  double tilt_sigma;
} ptzcal_health_options;

/** What a check came to. */
typedef struct ptzcal_health {
  /** Set by ptzcal_health_init. */
  uint32_t struct_size;
  /** A ptzcal_verdict. */
  uint32_t verdict;
  /** 1 when there were enough spots for a test. */
  uint32_t has_statistic;
  /** 1 when the camera's pose is refitted (ptzcal_health_report_refitted). */
  uint32_t has_refit;
  /** 1 when a head that lost its zero explains the spots. */
  uint32_t has_head_shift;
  /** Shots compared. */
  uint32_t shots;
  /** Shots used. */
  uint32_t used;
  /** Shots that are not seen again. */
  uint32_t not_seen;
  /** Shots where the laser meets something else. */
  uint32_t scene_changed;
  /** Shots that contradict all others. */
  uint32_t outliers;
  /** Test of unchanged: chi-square, when nothing has changed. */
  double chi2;
  /** Of it. */
  double degrees_of_freedom;
  /** Of a statistic as large or larger, were nothing changed. */
  double probability;
  /** What the refit turned and moved the camera by: w in R <- exp([w]x) R (camera axes, radians) and its centre (world, metres). */
  double change[6];
  /** Of it, row-major. */
  double change_covariance[36];
  /** What comes to the true pan and tilt, radians. */
  double head_shift[2];
  /** Of it: pan pan, pan tilt, tilt tilt, rad^2. */
  double head_shift_covariance[3];
} ptzcal_health;

/**
 * Sets up options: one false alarm in a hundred, a head that comes to rest to 0.1 mrad.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_options_init(ptzcal_health_options *options,
                                         size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a result: everything 0.
 *
 * @param health The struct.
 * @param size   sizeof *health.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_init(ptzcal_health *health, size_t size) PTZCAL_NOEXCEPT;

/**
 * The shots of a scan that are worth firing again to check a fixed camera: seen by both cameras, as far
 * from each other in the picture and in depth as can be.
 *
 * @param scan     The scan.
 * @param camera   The fixed camera's number.
 * @param count    How many are wanted; ten are enough. Fewer where there are no more.
 * @param buffer   Receives their indices, ascending; may be NULL when capacity is 0.
 * @param capacity How many fit.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS below four usable shots;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_choose_health_shots(const ptzcal_scan *scan,
                                              uint32_t camera,
                                              size_t count,
                                              size_t *buffer,
                                              size_t capacity,
                                              size_t *needed,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Compares the shots of a scan with those fired again. Shots of the earlier scan that were not seen by
 * both cameras do not count:
 * only shots at the readings of the later scan are compared.
 *
 * @param model       The rig.
 * @param calibration The fixed camera as it was, in the rig's frame.
 * @param before      The earlier scan.
 * @param again       The shots fired again.
 * @param camera      The fixed camera's number in both.
 * @param options     The options; may be NULL: the defaults.
 * @param report      Receives the report; free it with ptzcal_health_report_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK, whatever the verdict; PTZCAL_STATUS_INVALID_ARGUMENT,
 *         PTZCAL_STATUS_NOT_FINITE for input that makes no sense.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_check(const ptzcal_rig_model *model,
                                  const ptzcal_calibration *calibration,
                                  const ptzcal_scan *before,
                                  const ptzcal_scan *again,
                                  uint32_t camera,
                                  const ptzcal_health_options *options,
                                  ptzcal_health_report **report,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The same from spots that the host measured itself, at the same readings before and now, without a rig
 * and without scans.
 *
 * @param model       The rig.
 * @param calibration The fixed camera as it was, in the rig's frame.
 * @param readings    2 n numbers: pan and tilt of each shot, the device's readings, radians.
 * @param spots       20 n numbers: for each shot the spot in the head camera and in the fixed one before,
 *                    then in the head camera and in the fixed one now; of each u, v, pixels, and its
 *                    covariance xx, xy, yy, px^2, positive definite.
 * @param seen        2 n bytes: was the spot of each shot seen now in the head camera, in the fixed one? 0:
 *                    no, and its numbers do not matter, but for being finite; may be NULL: all were seen.
 * @param n           Number of shots, 1 to 10000.
 * @param options     The options; may be NULL: the defaults.
 * @param report      Receives the report; free it with ptzcal_health_report_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK, whatever the verdict; PTZCAL_STATUS_INVALID_ARGUMENT,
 *         PTZCAL_STATUS_NOT_FINITE for input that makes no sense.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_check_spots(const ptzcal_rig_model *model,
                                        const ptzcal_calibration *calibration,
                                        const double *readings,
                                        const double *spots,
                                        const uint8_t *seen,
                                        size_t n,
                                        const ptzcal_health_options *options,
                                        ptzcal_health_report **report,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a report.
 *
 * @param report The report; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_health_report_free(ptzcal_health_report *report) PTZCAL_NOEXCEPT;

/**
 * What a check came to.
 *
 * @param report The report.
 * @param health Receives it; set up by ptzcal_health_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_report_get(const ptzcal_health_report *report,
                                       ptzcal_health *health,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The verdict in words.
 *
 * @param report The report; may be NULL: "".
 * @return A string that lives as long as the report. Never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_health_report_reason(const ptzcal_health_report *report) PTZCAL_NOEXCEPT;

/**
 * What became of each shot that was compared, in the order of the earlier scan: ptzcal_shot_state.
 *
 * @param report   The report.
 * @param buffer   Receives the states; may be NULL when capacity is 0.
 * @param capacity How many fit.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_report_copy_shots(const ptzcal_health_report *report,
                                              uint32_t *buffer,
                                              size_t capacity,
                                              size_t *needed,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The camera with its pose refitted and its lens held.
 *
 * @param report      The report.
 * @param calibration Receives a calibration of its own, without residuals; free it with
 *                    ptzcal_calibration_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when nothing was refitted.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_health_report_refitted(const ptzcal_health_report *report,
                                            ptzcal_calibration **calibration,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: what is known
 *
 * A survey of one rig, from one or several stations, with all fixed cameras that watched it, to be
 * solved at once: the rig's laser line, head camera, axes and encoders, its pose at every station,
 * and each camera's intrinsics, lens and pose. What is known of them beforehand goes in as a prior:
 * a covariance about given values, where a variance of 0 fixes a parameter and INFINITY frees it.
 * Stations, cameras and shots count from 0 in the order of adding. Each function that adds does it
 * whole or not at all.
 * ============================================================================================= */

/** How many parameters a rig has: see ptzcal_rig_parameter. */
#define PTZCAL_RIG_PARAMETERS 15

/**
 * A rig's parameters, in the order of all vectors and covariances of them; the names are those of
 * ptzcal_rig_model's members.
 */
enum {
  /** Metres. */
  PTZCAL_RIG_PARAMETER_LASER_X0 = 0,
  /** Metres. */
  PTZCAL_RIG_PARAMETER_LASER_Y0 = 1,
  /** Slope, metres per metre of depth. */
  PTZCAL_RIG_PARAMETER_LASER_VX = 2,
  /** Slope, metres per metre of depth. */
  PTZCAL_RIG_PARAMETER_LASER_VY = 3,
  /**
   * One scale for fx, fy and skew of the head camera: the natural logarithm of fx, so that a
   * standard deviation is relative. The head's lens is taken as given.
   */
  PTZCAL_RIG_PARAMETER_HEAD_FOCAL = 4,
  /** Pixels. */
  PTZCAL_RIG_PARAMETER_HEAD_CX = 5,
  /** Pixels. */
  PTZCAL_RIG_PARAMETER_HEAD_CY = 6,
  /** Metres. */
  PTZCAL_RIG_PARAMETER_AXIS_TILT_Y = 7,
  /** Metres. */
  PTZCAL_RIG_PARAMETER_AXIS_TILT_Z = 8,
  /** Metres. */
  PTZCAL_RIG_PARAMETER_AXIS_PAN_X = 9,
  /** Metres. */
  PTZCAL_RIG_PARAMETER_AXIS_PAN_Z = 10,
  /** Radians. Turns the world of a single station: free it only beside something that holds it. */
  PTZCAL_RIG_PARAMETER_PAN_ZERO = 11,
  /** About 1. */
  PTZCAL_RIG_PARAMETER_PAN_SCALE = 12,
  /** Radians. */
  PTZCAL_RIG_PARAMETER_TILT_ZERO = 13,
  /** About 1. */
  PTZCAL_RIG_PARAMETER_TILT_SCALE = 14,
};
typedef uint32_t ptzcal_rig_parameter;

/** A survey to be adjusted. */
typedef struct ptzcal_adjustment ptzcal_adjustment;

/**
 * Makes a survey without stations, cameras and shots. Its rig is known exactly until
 * ptzcal_adjustment_set_rig_sigmas or ptzcal_adjustment_set_rig_covariance says otherwise.
 *
 * @param model      The rig as it is believed to be: the mean of its prior.
 * @param adjustment Receives the survey; free it with ptzcal_adjustment_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_new(const ptzcal_rig_model *model,
                                    ptzcal_adjustment **adjustment,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a survey. What was solved from it lives on.
 *
 * @param adjustment The survey; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_adjustment_free(ptzcal_adjustment *adjustment) PTZCAL_NOEXCEPT;

/**
 * Says how well each of the rig's parameters is known, independently of the others.
 *
 * @param adjustment The survey.
 * @param sigmas     PTZCAL_RIG_PARAMETERS standard deviations in the order of ptzcal_rig_parameter:
 *                   0 fixes a parameter, INFINITY frees it.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE for NaN (index: the parameter);
 *         PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_set_rig_sigmas(ptzcal_adjustment *adjustment,
                                               const double *sigmas,
                                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says how well the rig's parameters are known together, as the rig's own calibration left them: the
 * first 7 rows and columns are in the order of ptzcal_laser_line's `covariance`.
 *
 * @param adjustment The survey.
 * @param covariance 15 x 15 numbers in the order of ptzcal_rig_parameter, row-major, symmetric:
 *                   a variance of 0 fixes a parameter, INFINITY frees it (the rest of its row and
 *                   column is 0 then); those of the others are positive definite.
 * @param error      Receives the error; may be NULL.
 * @return As ptzcal_adjustment_set_rig_sigmas.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_set_rig_covariance(ptzcal_adjustment *adjustment,
                                                   const double *covariance,
                                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a place where the rig stood. Its frame is the rig's at pan = tilt = 0. The world is the
 * frame in which poses are given: usually the first station's, added with a pose as
 * ptzcal_pose_init leaves it. Other stations may be unknown: they are found from cameras that
 * another station's shots calibrate.
 *
 * @param adjustment The survey.
 * @param pose       The station in the world, X_world = rotation X_station + translation; its other
 *                   members do not matter, so that what ptzcal_pose_estimate_get gave can be handed
 *                   over; may be NULL: nothing is known.
 * @param covariance 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
 *                   of the translation (metres), as ptzcal_pose_estimate_copy_covariance gives them;
 *                   0 fixes and INFINITY frees as for the rig; may be NULL: the pose is exact. NULL
 *                   when the pose is.
 * @param station    Receives the station's index.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for what is no
 *         rotation or no covariance (the message names the parameter); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_station(ptzcal_adjustment *adjustment,
                                            const ptzcal_pose *pose,
                                            const double *covariance,
                                            uint32_t *station,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a fixed camera of which no more is known than the options say.
 *
 * @param adjustment The survey.
 * @param width      Image size in pixels, 1 to 65536.
 * @param height     Image size in pixels, 1 to 65536.
 * @param options    Lens model, known lens, and the priors of skew and aspect are taken from them,
 *                   nothing else; may be NULL: the defaults.
 * @param camera     Receives the camera's index.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_camera(ptzcal_adjustment *adjustment,
                                           uint32_t width,
                                           uint32_t height,
                                           const ptzcal_calibration_options *options,
                                           uint32_t *camera,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a fixed camera that was calibrated earlier, in the same world: the calibration with its
 * covariance becomes its prior. The measurements behind it must not be added again. Parameters that
 * were fixed there stay fixed.
 *
 * @param adjustment  The survey.
 * @param calibration The calibration.
 * @param camera      Receives the camera's index.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_calibrated_camera(ptzcal_adjustment *adjustment,
                                                      const ptzcal_calibration *calibration,
                                                      uint32_t *camera,
                                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a fixed camera of which some parameters are known, each to a standard deviation.
 *
 * @param adjustment The survey.
 * @param known      The camera as it is believed to be.
 * @param sigmas     n standard deviations in the order of ptzcal_calibration_copy_covariance: fx fy
 *                   skew cx cy (pixels), the coefficients of the camera's lens model, a turn about
 *                   the camera's own axes (3, radians), the centre (3, metres). 0 fixes a parameter,
 *                   INFINITY frees it.
 * @param n          11 plus the number of coefficients (0, 1, 4 or 5).
 * @param camera     Receives the camera's index.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE for NaN (index: the parameter);
 *         PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_known_camera(ptzcal_adjustment *adjustment,
                                                 const ptzcal_camera *known,
                                                 const double *sigmas,
                                                 size_t n,
                                                 uint32_t *camera,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: what was measured
 *
 * Laser shots with the spots that the head camera and the fixed cameras saw of them. A shot needs
 * no spot in the head camera: two cameras that see it measure it too.
 * ============================================================================================= */

/** For ptzcal_adjustment_add_scan: a fixed camera whose spots are left out. */
#define PTZCAL_NO_CAMERA 4294967294

/**
 * Adds laser shots: what the head read and where its camera saw the spot.
 *
 * @param adjustment      The survey.
 * @param station         Where the rig stood.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera; may be NULL: the head
 *                        camera saw none of them.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: 1 px,
 *                        uncorrelated.
 * @param seen            n bytes: 0 where the head camera saw no spot, and what stands in `spots`
 *                        does not matter (but is finite); may be NULL: it saw all.
 * @param n               Number of shots.
 * @param first           Receives the index of the first; the others follow it; may be NULL.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the shot, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a station that does not exist or a covariance that is
 *         none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_shots(ptzcal_adjustment *adjustment,
                                          uint32_t station,
                                          const double *pan_tilt,
                                          const double *spots,
                                          const double *spot_covariance,
                                          const uint8_t *seen,
                                          size_t n,
                                          size_t *first,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds where a fixed camera saw shots that were added before. The residuals and inliers of its
 * calibration are in the order of the shots.
 *
 * @param adjustment    The survey.
 * @param camera        The fixed camera.
 * @param shots         n indices of shots; a camera sees each at most once.
 * @param uv            n x 2 numbers: the spot's pixel in the camera.
 * @param uv_covariance n x 3 numbers: xx, xy, yy, positive definite, px^2; may be NULL: 1 px,
 *                      uncorrelated.
 * @param n             Number of sightings.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the sighting, in this call);
 *         PTZCAL_STATUS_INVALID_ARGUMENT for a camera or a shot that does not exist, a shot that is
 *         seen twice, or a covariance that is none; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_sightings(ptzcal_adjustment *adjustment,
                                              uint32_t camera,
                                              const size_t *shots,
                                              const double *uv,
                                              const double *uv_covariance,
                                              size_t n,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds all shots of a scan, with what the head camera and the fixed cameras saw: shot i of the scan
 * becomes shot `first` + i.
 *
 * @param adjustment The survey, for a head camera of the scan's image size.
 * @param station    Where the rig stood during the scan.
 * @param scan       The scan.
 * @param cameras    For each fixed camera of the scan its index in the survey (of the same image
 *                   size), or PTZCAL_NO_CAMERA.
 * @param n          Number of fixed cameras of the scan.
 * @param first      Receives the index of the scan's first shot; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a station or a camera that does not
 *         exist, another number of cameras, or another image size; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_scan(ptzcal_adjustment *adjustment,
                                         uint32_t station,
                                         const ptzcal_scan *scan,
                                         const uint32_t *cameras,
                                         size_t n,
                                         size_t *first,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: the answer
 *
 * Estimates of everything with their joint covariance. The answer holds its input, so that it can be
 * solved again.
 * ============================================================================================= */

/** A survey solved. Immutable: any number of threads may read it. */
typedef struct ptzcal_adjusted ptzcal_adjusted;

/** What an adjustment says about itself. */
typedef struct ptzcal_adjusted_summary {
  /** Set by ptzcal_adjusted_summary_init. */
  uint32_t struct_size;
  /** Iterations of all refinements. */
  uint32_t iterations;
  /** Parameters, fixed ones included: the side of the covariance matrix. */
  uint64_t parameters;
  /** Stations. */
  uint64_t stations;
  /** Fixed cameras. */
  uint64_t cameras;
  /** Shots. */
  uint64_t shots;
  /** Spots given, those of the head camera and of the fixed ones. */
  uint64_t spots;
  /** Spots used; the others are outliers. */
  uint64_t used;
  /** How many warnings there are: see ptzcal_adjusted_warning. */
  uint64_t warnings;
  /** How many groups of fixed parameters the data want to move: see ptzcal_adjusted_get_suspect. */
  uint64_t suspects;
  /** How many parameters the data say next to nothing of: see ptzcal_adjusted_prior_only. */
  uint64_t prior_only;
  /** Degrees of freedom of chi2. */
  uint64_t degrees_of_freedom;
  /** Sum of squared residuals in units of their standard deviations, priors included. */
  double chi2;
  /**
   * Chance of such residuals or larger when model and stated noise are right. Below 1e-3 the
   * covariance was scaled by chi2 / degrees_of_freedom, where that is more than 1, and a warning says so.
   */
  double probability;
  /** Noise that the residuals' median shows over the stated one, at least 1. */
  double noise_factor;
  /** Condition number of the normal equations, scaled to unit diagonal; 1 is perfect. */
  double condition;
  /** Planes. */
  uint64_t planes;
} ptzcal_adjusted_summary;

/**
 * Frees an answer. Texts taken from it die with it; calibrations taken from it live on.
 *
 * @param adjusted The answer; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_adjusted_free(ptzcal_adjusted *adjusted) PTZCAL_NOEXCEPT;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_summary_init(ptzcal_adjusted_summary *summary,
                                           size_t size) PTZCAL_NOEXCEPT;

/**
 * What the adjustment says about itself.
 *
 * @param adjusted The answer.
 * @param summary  Receives the summary; set up by ptzcal_adjusted_summary_init.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_summary(const ptzcal_adjusted *adjusted,
                                          ptzcal_adjusted_summary *summary,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The adjusted rig.
 *
 * @param adjusted The answer.
 * @param model    Receives the model; set up by ptzcal_rig_model_init.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_rig_model(const ptzcal_adjusted *adjusted,
                                            ptzcal_rig_model *model,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Where the rig stood: X_world = rotation X_station + translation.
 *
 * @param adjusted The answer.
 * @param station  The station's index.
 * @param pose     Receives the pose; set up by ptzcal_pose_init; the figures of an estimate by roof
 *                 edges are 0.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such station.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_station(const ptzcal_adjusted *adjusted,
                                          uint32_t station,
                                          ptzcal_pose *pose,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A fixed camera as a calibration of its own. Its covariance contains what is not known of rig and
 * stations; its residuals and inliers are of its sightings in the order of the shots.
 *
 * @param adjusted    The answer.
 * @param camera      The camera's index.
 * @param calibration Receives the calibration; free it with ptzcal_calibration_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such camera.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_calibration(const ptzcal_adjusted *adjusted,
                                              uint32_t camera,
                                              ptzcal_calibration **calibration,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The covariance of all parameters: p x p numbers, row-major, symmetric, p = the summary's
 * `parameters`. Their order: PTZCAL_RIG_PARAMETERS of the rig (ptzcal_rig_parameter); six of every
 * station (as ptzcal_adjustment_add_station takes them); those of every camera (as
 * ptzcal_calibration_copy_covariance has them); then three of every plane, of which
 * ptzcal_adjusted_get_plane says more. Rows and columns of fixed parameters are 0.
 *
 * @param adjusted The answer.
 * @param buffer   Receives the numbers; may be NULL when capacity is 0.
 * @param capacity How many numbers the buffer holds.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_copy_covariance(const ptzcal_adjusted *adjusted,
                                              double *buffer,
                                              size_t capacity,
                                              size_t *needed,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Name of a parameter of the covariance, such as "laser x0" or "camera 1 position z".
 *
 * @param adjusted The answer; may be NULL.
 * @param index    The parameter.
 * @return A string that lives as long as the answer; "" when there is no such parameter; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_adjusted_parameter_name(const ptzcal_adjusted *adjusted,
                                           size_t index) PTZCAL_NOEXCEPT;

/**
 * Solves the same survey again with the same options: the same bits.
 *
 * @param adjusted The answer.
 * @param cancel   Ends the call early from another thread; may be NULL.
 * @param result   Receives the new answer; free it with ptzcal_adjusted_free.
 * @param error    Receives the error; may be NULL.
 * @return As ptzcal_adjustment_solve.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_resolve(const ptzcal_adjusted *adjusted,
                                      const ptzcal_cancel *cancel,
                                      ptzcal_adjusted **result,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: does it fit?
 *
 * A chi-square test of all residuals (`probability` of the summary), a score test of every group of
 * parameters that was kept fixed, and what the data determine worst, also in words for a person.
 * ============================================================================================= */

/** A group of parameters that was fixed, and should perhaps not have been (a score test, Rao 1948). */
typedef struct ptzcal_suspect {
  /** Set by ptzcal_suspect_init. */
  uint32_t struct_size;
  /** Parameters of the group: the gain's degrees of freedom. */
  uint32_t parameters;
  /** By how much chi2 would fall, to first order, were the group free. */
  double gain;
  /** Chance of such a gain or a larger one when the group is rightly fixed. */
  double probability;
} ptzcal_suspect;

/**
 * What a person should know of the answer, one line of English UTF-8: a misfit, what it comes
 * from, a prior that contradicts the data. The wording may change in any version; decide by their
 * number, by `probability` and by the suspects.
 *
 * @param adjusted The answer; may be NULL.
 * @param index    From 0 to the summary's `warnings` less 1.
 * @return A string that lives as long as the answer; "" when there is no such warning; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_adjusted_warning(const ptzcal_adjusted *adjusted, size_t index) PTZCAL_NOEXCEPT;

/**
 * What the data and priors determine worst, and what to add, one line of English UTF-8.
 *
 * @param adjusted The answer; may be NULL.
 * @return A string that lives as long as the answer; "" for NULL; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_adjusted_weakest(const ptzcal_adjusted *adjusted) PTZCAL_NOEXCEPT;

/**
 * Name of a parameter of which the data say next to nothing: 0.95 or more of its prior standard
 * deviation is left.
 *
 * @param adjusted The answer; may be NULL.
 * @param index    From 0 to the summary's `prior_only` less 1.
 * @return A string that lives as long as the answer; "" when there is no such parameter; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_adjusted_prior_only(const ptzcal_adjusted *adjusted,
                                       size_t index) PTZCAL_NOEXCEPT;

/**
 * Sets up a suspect: everything 0.
 *
 * @param suspect The struct.
 * @param size    sizeof *suspect.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_suspect_init(ptzcal_suspect *suspect, size_t size) PTZCAL_NOEXCEPT;

/**
 * A group of fixed parameters that the data want to move, the most wanted first.
 *
 * @param adjusted The answer.
 * @param index    From 0 to the summary's `suspects` less 1.
 * @param suspect  Receives the suspect; set up by ptzcal_suspect_init.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such suspect.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_suspect(const ptzcal_adjusted *adjusted,
                                          size_t index,
                                          ptzcal_suspect *suspect,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Name of a suspect, such as "the axis offsets".
 *
 * @param adjusted The answer; may be NULL.
 * @param index    From 0 to the summary's `suspects` less 1.
 * @return A string that lives as long as the answer; "" when there is no such suspect; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_adjusted_suspect_name(const ptzcal_adjusted *adjusted,
                                         size_t index) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: points
 *
 * Where the laser hit, in the world, with covariances that contain what is not known of the rig, its
 * stations and the cameras.
 * ============================================================================================= */

/**
 * Which spots of the head camera were used: n bytes, n = the summary's `shots`; 1 for an inlier, 0
 * for an outlier and where the head camera saw none.
 *
 * @param adjusted The answer.
 * @param buffer   Receives the bytes; may be NULL when capacity is 0.
 * @param capacity How many bytes the buffer holds.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_copy_head_inliers(const ptzcal_adjusted *adjusted,
                                                uint8_t *buffer,
                                                size_t capacity,
                                                size_t *needed,
                                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Where a shot hit, by all who saw it.
 *
 * @param adjusted   The answer.
 * @param shot       The shot's index.
 * @param xyz        Receives 3 numbers: the point in the world, metres.
 * @param covariance Receives 9 numbers: its covariance, row-major, m^2, which contains what is not
 *                   known of rig, station and cameras (of rank one, along the beam, when rig and
 *                   station are exact); may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE for a shot at infinity or one of which no spot
 *         was used; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such shot.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_shot_point(const ptzcal_adjusted *adjusted,
                                         size_t shot,
                                         double *xyz,
                                         double *covariance,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Measures new spots of the head camera with the adjusted rig.
 *
 * @param adjusted        The answer.
 * @param station         Where the rig stands.
 * @param pan_tilt        n x 2 numbers: readings at each shot, radians.
 * @param spots           n x 2 numbers: the spot's pixel in the head camera.
 * @param spot_covariance n x 3 numbers: xx, xy, yy, px^2; may be NULL: 1 px, uncorrelated.
 * @param n               Number of shots.
 * @param xyz             Receives n x 3 numbers: points in the world, metres.
 * @param covariance      Receives n x 9 numbers: covariance of each point, row-major, m^2, those of
 *                        rig and station included; may be NULL.
 * @param error           Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE for a spot at or beyond infinity;
 *         PTZCAL_STATUS_NOT_FINITE (index: the shot); PTZCAL_STATUS_INVALID_ARGUMENT for a station
 *         that does not exist, a spot outside the lens model or a covariance that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_measure(const ptzcal_adjusted *adjusted,
                                      uint32_t station,
                                      const double *pan_tilt,
                                      const double *spots,
                                      const double *spot_covariance,
                                      size_t n,
                                      double *xyz,
                                      double *covariance,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: planes
 *
 * Walls, floors, sides of furniture: surfaces that shots of several stations hit. Where each plane lies is
 * found with the rest; a station that shares three planes across each other with another one needs no
 * known pose and no camera in common with it. Planes count from 0 in the order of adding.
 * ============================================================================================= */

/** For ptzcal_adjustment_set_planes: a shot that hit none. */
#define PTZCAL_NO_PLANE 4294967295

/**
 * Adds a plane, whose place is found.
 *
 * @param adjustment The survey.
 * @param flatness   How far its surface strays from it: standard deviation, 1e-6 to 1 m. A painted wall
 *                   has about 0.002.
 * @param plane      Receives its index; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another flatness; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_add_plane(ptzcal_adjustment *adjustment,
                                          double flatness,
                                          uint32_t *plane,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says which plane each of several shots hit. Where that is wrong, it is set aside like any other outlier.
 *
 * @param adjustment The survey.
 * @param first      The first shot; the others follow it.
 * @param hits       n indices of planes, or PTZCAL_NO_PLANE.
 * @param n          Number of shots.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a shot or a plane that does not exist and
 *         for a shot that was said to hit one already (none is taken then); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_set_planes(ptzcal_adjustment *adjustment,
                                           size_t first,
                                           const uint32_t *hits,
                                           size_t n,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A plane of the scene in the world: normal . X = distance.
 *
 * @param adjusted   The answer.
 * @param plane      The plane's index.
 * @param values     Receives 4 numbers: its unit normal and its distance from the origin, metres.
 * @param covariance Receives 16 numbers: the covariance of these, row-major; the normal moves only across
 *                   itself, so that its rank is three; may be NULL.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT when there is no such plane.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_get_plane(const ptzcal_adjusted *adjusted,
                                        uint32_t plane,
                                        double *values,
                                        double *covariance,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Which shots hit the plane that they were said to hit: one byte a shot, 1 where the answer uses it, 0
 * where it was set aside or no plane was named.
 *
 * @param adjusted The answer.
 * @param buffer   Receives the bytes; may be NULL when capacity is 0.
 * @param capacity How many bytes the buffer holds.
 * @param needed   Receives how many there are, also when they do not fit; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjusted_copy_plane_inliers(const ptzcal_adjusted *adjusted,
                                                 uint8_t *buffer,
                                                 size_t capacity,
                                                 size_t *needed,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Stations along a path
 *
 * A survey from many stations, of which nobody needs to say which shots hit which wall: every pair of
 * stations is registered by the planes that both saw, planes that are the same become one, loops of stations
 * are closed as a test, and the shots that hit the planes enter the joint adjustment. Solving it puts all
 * stations, and every fixed camera that any of them lit, into one frame with their covariance.
 * ============================================================================================= */

/** What ties the stations of a survey. Immutable: any number of threads may read it. */
typedef struct ptzcal_ties ptzcal_ties;

/** How stations are tied. */
typedef struct ptzcal_tie_options {
  /** Set by ptzcal_tie_options_init. */
  uint32_t struct_size;
  /** 0. */
  uint32_t reserved;
  /**
   * How planes are found; their flatness is that of the survey's planes too, 1e-6 to 1 m. NULL: the
   * defaults.
   */
  const ptzcal_planes_options *planes;
  /**
   * How two stations are registered; a prior only where there is one pair: what is known of the stations
   * is said with their poses. NULL: the defaults.
   */
  const ptzcal_station_options *stations;
  /** Pairs of stations to register, 2 numbers a pair, each pair once. NULL: every station with every other. */
  const uint32_t *pairs;
  /** Number of pairs; 0 with NULL. */
  size_t pair_count;
  /** Chance below which a loop of stations does not close and is refused, 0 to 1. */
  double min_closure;
} ptzcal_tie_options;

/** What ties the stations of a survey, in numbers. */
typedef struct ptzcal_ties_summary {
  /** Set by ptzcal_ties_summary_init. */
  uint32_t struct_size;
  /** Pairs of stations that were tried: see ptzcal_ties_get_link. */
  uint32_t links;
  /** Those of them that have a pose. */
  uint32_t linked;
  /** Loops of links: see ptzcal_ties_get_loop. */
  uint32_t loops;
  /** Planes that were added to the survey. */
  uint64_t planes;
  /** Shots that were said to hit one of them. */
  uint64_t shots;
} ptzcal_ties_summary;

/** Two stations that were tried. */
typedef struct ptzcal_link {
  /** Set by ptzcal_link_init. */
  uint32_t struct_size;
  /**
   * A ptzcal_status: PTZCAL_STATUS_OK where planes tell the pose between them, or why they do not, as
   * ptzcal_register_stations says it (PTZCAL_STATUS_AMBIGUOUS for instance).
   */
  int32_t status;
  /** Station a. */
  uint32_t station_a;
  /** Station b. */
  uint32_t station_b;
} ptzcal_link;

/** A loop of stations, and what is left when its links are followed all the way around. */
typedef struct ptzcal_loop {
  /** Set by ptzcal_loop_init. */
  uint32_t struct_size;
  /** How many stations it has: see ptzcal_ties_copy_loop. */
  uint32_t stations;
  /** Angle that is left, radians. */
  double rotation;
  /** Distance that is left, metres. */
  double position;
  /** Chance of that or more by the links' covariances. */
  double probability;
} ptzcal_loop;

/**
 * Sets up options: all pairs of stations, the defaults of ptzcal_planes_options_init and
 * ptzcal_station_options_init, loops that close by a chance of 1e-6 or more.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_tie_options_init(ptzcal_tie_options *options,
                                      size_t size) PTZCAL_NOEXCEPT;

/**
 * Finds the planes that the stations of a survey share, and adds them to it with the shots that hit them. Of
 * the stations no pose needs to be known; what was said of them (odometry, with its covariance) settles what
 * planes alone leave ambiguous. Shots that the head camera did not see say nothing here. A survey that is
 * refused is left as it was. ptzcal_adjustment_solve then finds stations and cameras together.
 *
 * @param adjustment The survey, at most 100 stations. It is in use until the call returns.
 * @param options    The options, set up by ptzcal_tie_options_init; may be NULL: the defaults.
 * @param progress   Hears how many steps are done (each station is one, then each pair), and can stop them;
 *                   may be NULL.
 * @param user       Handed to it.
 * @param token      Stops it from another thread; may be NULL. It is looked at before each step.
 * @param ties       Receives what ties the stations; free it with ptzcal_ties_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BAD_STATE when a station without a pose shares planes with none of
 *         the others (the message has the reason of each pair); PTZCAL_STATUS_AMBIGUOUS when a loop of
 *         stations does not close (the message has it); PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_tie_stations(ptzcal_adjustment *adjustment,
                                             const ptzcal_tie_options *options,
                                             ptzcal_progress_fn progress,
                                             void *user,
                                             const ptzcal_cancel *token,
                                             ptzcal_ties **ties,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees ties. Registrations taken from them live on.
 *
 * @param ties The ties; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_ties_free(ptzcal_ties *ties) PTZCAL_NOEXCEPT;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_summary_init(ptzcal_ties_summary *summary,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * How many links, loops, planes and shots there are.
 *
 * @param ties    The ties.
 * @param summary Receives the numbers; set up by ptzcal_ties_summary_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_get_summary(const ptzcal_ties *ties,
                                      ptzcal_ties_summary *summary,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a link: everything 0.
 *
 * @param link The struct.
 * @param size sizeof *link.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_link_init(ptzcal_link *link, size_t size) PTZCAL_NOEXCEPT;

/**
 * A pair of stations that was tried: in the order of the options' pairs, or 0 and 1, 0 and 2, and so on.
 *
 * @param ties  The ties.
 * @param index Which one, from 0.
 * @param link  Receives the link; set up by ptzcal_link_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_get_link(const ptzcal_ties *ties,
                                   uint32_t index,
                                   ptzcal_link *link,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Why planes do not tell the pose between the stations of a link.
 *
 * @param ties  The ties; may be NULL.
 * @param index The link.
 * @return A string that lives as long as the ties; "" for a link that has a pose and when there is no such
 *         link; never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_ties_link_reason(const ptzcal_ties *ties,
                                    uint32_t index) PTZCAL_NOEXCEPT;

/**
 * The pose between the stations of a link, and the planes that it is from.
 *
 * @param ties         The ties.
 * @param index        The link.
 * @param registration Receives the registration; free it with ptzcal_registration_free.
 * @param error        Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none; the link's status
 *         for one that has no pose.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_get_registration(const ptzcal_ties *ties,
                                           uint32_t index,
                                           ptzcal_registration **registration,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Sets up a loop: everything 0.
 *
 * @param closure The struct.
 * @param size    sizeof *closure.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_loop_init(ptzcal_loop *closure, size_t size) PTZCAL_NOEXCEPT;

/**
 * How well a loop of stations closes.
 *
 * @param ties    The ties.
 * @param index   Which loop, from 0.
 * @param closure Receives what is left; set up by ptzcal_loop_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_get_loop(const ptzcal_ties *ties,
                                   uint32_t index,
                                   ptzcal_loop *closure,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Copies the stations of a loop in their order; the last is linked to the first.
 *
 * @param ties     The ties.
 * @param index    The loop.
 * @param buffer   Receives the stations; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives the number of stations; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for an index that is none;
 *         PTZCAL_STATUS_BUFFER_TOO_SMALL: nothing was copied.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ties_copy_loop(const ptzcal_ties *ties,
                                    uint32_t index,
                                    uint32_t *buffer,
                                    size_t capacity,
                                    size_t *needed,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Joint adjustment: solving
 *
 * The maximum-likelihood estimate of everything that is free, from a cold start, by
 * ptzcal_adjustment_solve. Gross outliers are set aside, and the residuals and every fixed group of
 * parameters are tested: the answer's warnings say whether model and stated noise can be believed.
 * ============================================================================================= */

/** How a survey is solved. The defaults are right for spots that the library detected. */
typedef struct ptzcal_adjust_options {
  /** Set by ptzcal_adjust_options_init. */
  uint32_t struct_size;
  /** 1 (the default): gross outliers are found and set aside. 0: all spots are used. */
  uint32_t robust;
  /** Most iterations of one refinement, 1 to 10000; the default is 100. */
  uint32_t max_iterations;
  /** 0. */
  uint32_t reserved;
  /** Seed of the consensus that starts each camera; the default is 1. */
  uint64_t seed;
  /**
   * Standard deviation of the head's true pan about its readings, from shot to shot
   * (repeatability and quantisation), radians; the default is 0: the encoders are exact.
   */
  double pointing_sigma_pan;
  /** The same of tilt. */
  double pointing_sigma_tilt;
  /**
   * Residuals of more standard deviations than this count linearly (Huber 1964), positive; the
   * default is 3; INFINITY: least squares.
   */
  double huber;
  /**
   * Largest standard deviation over focal length of a camera, positive: above it the answer is
   * refused (PTZCAL_STATUS_DEGENERATE); the default is 0.1; INFINITY takes whatever was found.
   */
  double max_focal_deviation;
  /**
   * Refuse (PTZCAL_STATUS_DEGENERATE, with the direction) when a station that is not fixed is
   * determined worse than this: its rotation in radians, its position as a share of the median range
   * of its shots; positive; the default is 0.1; INFINITY takes whatever was found.
   */
  double max_station_deviation;
} ptzcal_adjust_options;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjust_options_init(ptzcal_adjust_options *options,
                                         size_t size) PTZCAL_NOEXCEPT;

/**
 * Solves a survey. It is in use until the call returns: other threads may solve it too, but adding
 * to it is PTZCAL_STATUS_BUSY. The same survey, options and seed give the same bits.
 *
 * @param adjustment The survey.
 * @param options    The options, set up by ptzcal_adjust_options_init; may be NULL: the defaults.
 * @param cancel     Ends the call early from another thread; may be NULL.
 * @param result     Receives the answer; free it with ptzcal_adjusted_free.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS and other reasons of
 *         ptzcal_calibrate_camera (index: the camera that cannot be calibrated);
 *         PTZCAL_STATUS_DEGENERATE (the message names what trades off and what to add);
 *         PTZCAL_STATUS_BAD_STATE when nothing is free, or for an unknown station that shares no
 *         camera and no three planes with the others; PTZCAL_STATUS_BEHIND_CAMERA (index: the shot)
 *         when robust is 0;
 *         PTZCAL_STATUS_NO_CONSENSUS; PTZCAL_STATUS_NO_CONVERGENCE; PTZCAL_STATUS_LENS_NOT_MONOTONE;
 *         PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_adjustment_solve(const ptzcal_adjustment *adjustment,
                                      const ptzcal_adjust_options *options,
                                      const ptzcal_cancel *cancel,
                                      ptzcal_adjusted **result,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Sites: what is known before anyone scans
 *
 * A rig, the fixed camera that it will calibrate (its guessed pose and lens, in the rig's frame), what is
 * not known of the rig, and what surrounds both. Studies, labels, plans and next shots begin with it.
 * ============================================================================================= */

/** Rig, fixed camera and surroundings. */
typedef struct ptzcal_site ptzcal_site;

/**
 * Makes a site: a rig that is known exactly, no surroundings yet.
 *
 * @param model  The rig.
 * @param camera The fixed camera, its pose in the rig's frame; the lens model that it has is the one that
 *               will be fitted.
 * @param site   Receives the site; free it with ptzcal_site_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_LENS_NOT_MONOTONE.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_new(const ptzcal_rig_model *model,
                              const ptzcal_camera *camera,
                              ptzcal_site **site,
                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a site.
 *
 * @param site The site; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_site_free(ptzcal_site *site) PTZCAL_NOEXCEPT;

/**
 * Says how well the rig's parameters are known.
 *
 * @param site   The site.
 * @param sigmas 15 standard deviations in the order of ptzcal_rig_parameter; 0 fixes a parameter (all of
 *               them by default), INFINITY frees it.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (the message names the parameter);
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_rig_sigmas(ptzcal_site *site,
                                         const double *sigmas,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says how well single moves of the head are known.
 *
 * @param site       The site.
 * @param sigma_pan  Standard deviation of the true pan about its readings, radians; the default is 0.
 * @param sigma_tilt The same of tilt.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_pointing_sigma(ptzcal_site *site,
                                             double sigma_pan,
                                             double sigma_tilt,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says how the camera will be calibrated: lens model (that of the site's camera), known lens, beliefs
 * about skew and aspect. The options' other settings do not matter here.
 *
 * @param site    The site.
 * @param options The options; may be NULL: the defaults with the camera's lens model.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for another lens model than the camera's;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_estimate(ptzcal_site *site,
                                       const ptzcal_calibration_options *options,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Surrounds rig and camera by one plane: a wall, a floor.
 *
 * @param site     The site.
 * @param normal   Its normal n, 3 numbers of any length: n . x = distance in the rig's frame.
 * @param distance Metres for a normal of unit length.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_plane(ptzcal_site *site,
                                    const double *normal,
                                    double distance,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Surrounds rig and camera by a room with boxes in it, which also hide what is behind them.
 *
 * @param site  The site.
 * @param room  6 numbers: the lower corner x y z, then the higher one; the rig's frame, metres.
 * @param boxes 6 numbers for each box; may be NULL when there is none.
 * @param n     Boxes, 10,000 at most.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for corners in the wrong order;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_room(ptzcal_site *site,
                                   const double *room,
                                   const double *boxes,
                                   size_t n,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says of the surroundings only which depths occur: every position gets one of them.
 *
 * @param site     The site.
 * @param nearest  Least depth along the head's axis, metres.
 * @param farthest Greatest depth.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_site_set_depths(ptzcal_site *site,
                                     double nearest,
                                     double farthest,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Set-ups: a site with noiseless shots
 *
 * The data set of a noise study: what both cameras would see of every shot without noise (thesis VII.2). It
 * comes from the site's surroundings, from a scan whose points are taken for true, or from any points.
 * ============================================================================================= */

/** A site with its noiseless shots. */
typedef struct ptzcal_set_up ptzcal_set_up;

/**
 * The shots of a region that both cameras would see in the site's surroundings.
 *
 * @param site   The site.
 * @param region The positions.
 * @param set_up Receives the set-up; free it with ptzcal_set_up_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BAD_STATE for a site without surroundings;
 *         PTZCAL_STATUS_TOO_FEW_POINTS when fewer than six are in view; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_set_up_from_region(const ptzcal_site *site,
                                        const ptzcal_region *region,
                                        ptzcal_set_up **set_up,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The points of a scan, taken for true and projected anew into both cameras; those that are not in view of
 * both are left out.
 *
 * @param site   The site; its camera is where the scan's fixed camera was found, its rig the scan's.
 * @param scan   The scan.
 * @param set_up Receives the set-up; free it with ptzcal_set_up_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_set_up_from_scan(const ptzcal_site *site,
                                      const ptzcal_scan *scan,
                                      ptzcal_set_up **set_up,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Points at which the laser is aimed; those out of its reach or not in view of both cameras are left out.
 *
 * @param site   The site.
 * @param xyz    n points in the rig's frame, metres.
 * @param n      Points, 1,000,000 at most.
 * @param set_up Receives the set-up; free it with ptzcal_set_up_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the point);
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_set_up_from_points(const ptzcal_site *site,
                                        const double *xyz,
                                        size_t n,
                                        ptzcal_set_up **set_up,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Gives the points by which the cascade as printed (PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED) finds the head
 * camera's pose: the corners of the thesis's boards. No other method needs them.
 *
 * @param set_up The set-up.
 * @param xyz    n points in the rig's frame, metres, in front of the head camera at pan = tilt = 0.
 * @param n      Points.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE (index: the point); PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_set_up_set_control(ptzcal_set_up *set_up,
                                        const double *xyz,
                                        size_t n,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The number of shots that both cameras see.
 *
 * @param set_up The set-up.
 * @param count  Receives the number.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_set_up_get_count(const ptzcal_set_up *set_up,
                                      size_t *count,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a set-up.
 *
 * @param set_up The set-up; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_set_up_free(ptzcal_set_up *set_up) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Noise study
 *
 * How do noises of head and fixed camera reach the fixed camera's estimate? (thesis VII, VIII.D) Monte Carlo
 * with every estimator that is asked for, at every noise level, beside what the closed-form covariance
 * expects. The same set-up, options and seed give the same bits with any number of threads.
 * ============================================================================================= */

/** How the fixed camera is estimated. */
enum {
  /** DLT-Points from exact 3D points: no cascade. */
  PTZCAL_STUDY_METHOD_DLT_EXACT = 0,
  /**
   * The thesis's eq. (23) as printed: exact points moved by the head camera's noisy pose. A rigid
   * motion, which does not touch the lens and says little of a laser rig; needs
   * ptzcal_set_up_set_control.
   */
  PTZCAL_STUDY_METHOD_DLT_CASCADE_PRINTED = 1,
  /** The cascade in its right form: noisy spots, so noisy points, then DLT-Points. */
  PTZCAL_STUDY_METHOD_DLT_CASCADE = 2,
  /** The closed form in inverse depth, weighted by the noise. */
  PTZCAL_STUDY_METHOD_CLOSED_FORM = 3,
  /**
   * Maximum likelihood with the site's beliefs: as ptzcal_calibrate_camera or
   * ptzcal_adjustment_solve would do it.
   */
  PTZCAL_STUDY_METHOD_JOINT_ML = 4,
};
typedef uint32_t ptzcal_study_method;

/** Which noise the levels share. */
enum {
  /**
   * A trial's noise is drawn once and scaled to every level: differences between levels are theirs
   * and not luck's, and most of the work is shared.
   */
  PTZCAL_STUDY_DRAWS_COMMON = 0,
  /** Every level draws its own. */
  PTZCAL_STUDY_DRAWS_INDEPENDENT = 1,
};
typedef uint32_t ptzcal_study_draws;

/** What is measured of a camera's error: the order of every array of four. */
enum {
  /** Distance of the position from the true one, metres. */
  PTZCAL_STUDY_QUANTITY_POSITION = 0,
  /** Angle of the rotation from the true one, radians. */
  PTZCAL_STUDY_QUANTITY_ROTATION = 1,
  /** Of (fx, fy), pixels. */
  PTZCAL_STUDY_QUANTITY_FOCAL = 2,
  /** Of (cx, cy), pixels. */
  PTZCAL_STUDY_QUANTITY_PRINCIPAL_POINT = 3,
};
typedef uint32_t ptzcal_study_quantity;

/** Charts of a study. */
enum {
  /** Root mean square error against noise, a line for each method; of a ptzcal_study_quantity. */
  PTZCAL_STUDY_PLOT_ERRORS = 0,
  /** Mean position error over the noises of both cameras; of a ptzcal_study_method. */
  PTZCAL_STUDY_PLOT_GRID = 1,
  /** Estimated positions from above; of a level, by its index. */
  PTZCAL_STUDY_PLOT_SCATTER = 2,
};
typedef uint32_t ptzcal_study_plot;

/** The answer of a study. Immutable: any number of threads may read it. */
typedef struct ptzcal_study ptzcal_study;

/** How a study is made. */
typedef struct ptzcal_study_options {
  /** Set by ptzcal_study_options_init. */
  uint32_t struct_size;
  /**
   * Bit 1 << method for each ptzcal_study_method; the default is all but the printed cascade. A label
   * takes the highest one.
   */
  uint32_t methods;
  /** A ptzcal_study_draws; the default is common noise. */
  uint32_t draws;
  /** Trials, 1 to 100,000; the default is 100. */
  uint32_t trials;
  /** Threads that work, 1 to 1024, the caller's among them; the default is 1. */
  uint32_t threads;
  /** 0. */
  uint32_t reserved;
  /** The default is 1. */
  uint64_t seed;
} ptzcal_study_options;

/** Errors of one method at one noise level. */
typedef struct ptzcal_study_cell {
  /** Set by ptzcal_study_cell_init. */
  uint32_t struct_size;
  /** Trials that gave a camera. */
  uint32_t used;
  /** Trials that gave none. */
  uint32_t failures;
  /** 0. */
  uint32_t reserved;
  /** Noise of the head camera's spot, px. */
  double head_sigma;
  /** Noise of the fixed camera's, px. */
  double fixed_sigma;
  /** Mean size of the error, by ptzcal_study_quantity; INFINITY when no trial gave a camera. */
  double mean[4];
  /** Root mean square. */
  double rms[4];
  /** Size of the mean error: what more trials, or more shots, do not take away. */
  double bias[4];
  /**
   * Root mean square that the closed-form covariance of the maximum-likelihood estimate expects at this
   * level; INFINITY in a study whose methods take no shots.
   */
  double expected[4];
} ptzcal_study_cell;

/**
 * Sets up options with their defaults.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_options_init(ptzcal_study_options *options,
                                        size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a cell: everything 0.
 *
 * @param cell The struct.
 * @param size sizeof *cell.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_cell_init(ptzcal_study_cell *cell, size_t size) PTZCAL_NOEXCEPT;

/**
 * Makes a study.
 *
 * @param set_up    The set-up.
 * @param levels    n pairs of noises, px: of the head camera's spot, of the fixed camera's; 0 to 1000.
 * @param n         Levels, 1 to 10,000.
 * @param distances m distances from the fixed camera at which points are handed off, metres; may be NULL
 *                  when there is none.
 * @param m         Distances, at most 1000.
 * @param options   The options; may be NULL: the defaults.
 * @param progress  Hears how many trials are done, and can stop the study; may be NULL.
 * @param user      Handed to it.
 * @param token     Stops the study from another thread; may be NULL.
 * @param study     Receives the study; free it with ptzcal_study_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE;
 *         PTZCAL_STATUS_DEGENERATE or PTZCAL_STATUS_TOO_FEW_POINTS when the shots cannot determine the
 *         camera; PTZCAL_STATUS_CANCELLED when it was stopped; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_run(const ptzcal_set_up *set_up,
                               const double *levels,
                               size_t n,
                               const double *distances,
                               size_t m,
                               const ptzcal_study_options *options,
                               ptzcal_progress_fn progress,
                               void *user,
                               const ptzcal_cancel *token,
                               ptzcal_study **study,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The errors of a method at a level.
 *
 * @param study  The study.
 * @param method A ptzcal_study_method that was asked for.
 * @param level  Index of the level.
 * @param cell   Receives the errors; set up by ptzcal_study_cell_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_get_cell(const ptzcal_study *study,
                                    uint32_t method,
                                    size_t level,
                                    ptzcal_study_cell *cell,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Root mean square errors of points handed off: where the fixed camera believes a pixel's point at a
 * distance to be, over 3 x 3 pixels of its image.
 *
 * @param study    The study.
 * @param method   A ptzcal_study_method that was asked for.
 * @param level    Index of the level.
 * @param buffer   Receives metres, one for each distance of the study; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives the number of distances; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_copy_handoff(const ptzcal_study *study,
                                        uint32_t method,
                                        size_t level,
                                        double *buffer,
                                        size_t capacity,
                                        size_t *needed,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes all figures of a study as JSON; an infinite one is null.
 *
 * @param study The study.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_save_json(const ptzcal_study *study,
                                     const char *path,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes all figures of a study as CSV, a line for each method and level.
 *
 * @param study The study.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_save_csv(const ptzcal_study *study,
                                    const char *path,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws a chart as a self-contained SVG.
 *
 * @param study The study.
 * @param plot  A ptzcal_study_plot.
 * @param of    What it is of: a quantity, a method or a level, as the plot says.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_study_save_plot(const ptzcal_study *study,
                                     uint32_t plot,
                                     uint32_t of,
                                     const char *path,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a study.
 *
 * @param study The study; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_study_free(ptzcal_study *study) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Precision label
 *
 * What can be expected of a set-up (thesis VIII.D): the fixed camera's error against working distance and
 * noise, simulated and by the closed-form covariance, with the error of points handed off at that
 * distance. Shots up to a distance are what a rig has that works no farther.
 * ============================================================================================= */

/** What ptzcal_label_save_plot takes, besides a ptzcal_study_quantity, for the error of points handed off. */
#define PTZCAL_LABEL_HANDOFF 4

/** A precision label. Immutable: any number of threads may read it. */
typedef struct ptzcal_label ptzcal_label;

/** One line of a label: root mean square errors. */
typedef struct ptzcal_label_row {
  /** Set by ptzcal_label_row_init. */
  uint32_t struct_size;
  /** Shots up to the distance. */
  uint32_t shots;
  /** Trials that gave no camera. */
  uint32_t failures;
  /** 0. */
  uint32_t reserved;
  /** Working distance, metres. */
  double distance;
  /** Noise of the head camera's spot, px. */
  double head_sigma;
  /** Noise of the fixed camera's, px. */
  double fixed_sigma;
  /** Simulated, by ptzcal_study_quantity; INFINITY when no trial gave a camera. */
  double simulated[4];
  /**
   * By the closed-form covariance of the maximum-likelihood estimate; INFINITY for methods that take
   * no shots.
   */
  double expected[4];
  /** Of a point handed off at the distance, metres. */
  double handoff_simulated;
  /** The same by the covariance. */
  double handoff_expected;
} ptzcal_label_row;

/**
 * Sets up a row: everything 0.
 *
 * @param row  The struct.
 * @param size sizeof *row.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_row_init(ptzcal_label_row *row, size_t size) PTZCAL_NOEXCEPT;

/**
 * Makes a label.
 *
 * @param set_up    The set-up.
 * @param distances m working distances, metres.
 * @param m         Distances, 1 to 1000.
 * @param levels    n pairs of noises, px: of the head camera's spot, of the fixed camera's.
 * @param n         Levels, 1 to 10,000.
 * @param options   Of the method (the highest bit), trials, threads and seed; may be NULL: the defaults,
 *                  maximum likelihood.
 * @param progress  Hears how many trials are done, and can stop it; may be NULL.
 * @param user      Handed to it.
 * @param token     Stops it from another thread; may be NULL.
 * @param label     Receives the label; free it with ptzcal_label_free.
 * @param error     Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS or PTZCAL_STATUS_DEGENERATE when the shots up to
 *         none of the distances determine a camera; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_make(const ptzcal_set_up *set_up,
                                const double *distances,
                                size_t m,
                                const double *levels,
                                size_t n,
                                const ptzcal_study_options *options,
                                ptzcal_progress_fn progress,
                                void *user,
                                const ptzcal_cancel *token,
                                ptzcal_label **label,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The number of rows: distance by distance, level by level within. Distances up to which the shots do not
 * determine a camera have none.
 *
 * @param label The label.
 * @param count Receives the number.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_get_count(const ptzcal_label *label,
                                     size_t *count,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A row of a label.
 *
 * @param label The label.
 * @param index The row.
 * @param row   Receives the row; set up by ptzcal_label_row_init.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_get_row(const ptzcal_label *label,
                                   size_t index,
                                   ptzcal_label_row *row,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a label as JSON; an infinite figure is null.
 *
 * @param label The label.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_save_json(const ptzcal_label *label,
                                     const char *path,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a label as CSV, a line for each row.
 *
 * @param label The label.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_save_csv(const ptzcal_label *label,
                                    const char *path,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Draws errors against the working distance, a line for each level, as a self-contained SVG.
 *
 * @param label The label.
 * @param of    A ptzcal_study_quantity, or PTZCAL_LABEL_HANDOFF.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_label_save_plot(const ptzcal_label *label,
                                     uint32_t of,
                                     const char *path,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a label.
 *
 * @param label The label; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_label_free(ptzcal_label *label) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Planning, and the next best shots
 *
 * How many shots, and where, for a target accuracy of the fixed camera's position: before anyone scans
 * (ptzcal_plan_make), and between shots (ptzcal_next_shots). A shot is written as 5 numbers: pan and tilt
 * (the device's readings, radians), the depth that is expected there (metres), and the position's expected
 * error after it and all before it: root mean square, and largest semi-axis (metres).
 * ============================================================================================= */

/** A plan. Immutable: any number of threads may read it. */
typedef struct ptzcal_plan ptzcal_plan;

/** What is wanted of a plan. */
typedef struct ptzcal_plan_options {
  /** Set by ptzcal_plan_options_init. */
  uint32_t struct_size;
  /** Most positions of a grid, 1 to 1,000,000; the default is 20,000. */
  uint32_t max_positions;
  /** Least reading of pan, radians. */
  double pan_min;
  /** Greatest reading of pan, radians. */
  double pan_max;
  /** Least reading of tilt, radians. */
  double tilt_min;
  /** Greatest reading of tilt, radians. */
  double tilt_max;
  /** Noise of a spot in the head camera, px; the default is 0.2. */
  double head_sigma;
  /** Noise of a spot in the fixed camera, px; the default is 0.2. */
  double fixed_sigma;
  /** Wanted root mean square error of the fixed camera's position, metres; the default is 0.01. */
  double target;
} ptzcal_plan_options;

/** What a plan comes to. */
typedef struct ptzcal_plan_summary {
  /** Set by ptzcal_plan_summary_init. */
  uint32_t struct_size;
  /** The coarsest grid over the region that reaches the target: positions of pan. */
  uint32_t pan_steps;
  /** Positions of tilt. */
  uint32_t tilt_steps;
  /** Of its positions those that both cameras see. */
  uint32_t grid_seen;
  /** Chosen shots that reach it too: ptzcal_plan_copy_shots. */
  uint32_t shots;
  /** The ptzcal_rig_parameter that limits any number of shots; -1 when the rig is known exactly. */
  int32_t limited_by;
  /** Expected root mean square error of the position after the grid, metres. */
  double grid_rms;
  /** Its largest semi-axis, metres. */
  double grid_semi_axis;
  /** What any number of shots would leave: what is not known of the rig, metres. */
  double limit_rms;
} ptzcal_plan_summary;

/**
 * Sets up options with their defaults; the region must still be set.
 *
 * @param options The struct.
 * @param size    sizeof *options.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plan_options_init(ptzcal_plan_options *options,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plan_summary_init(ptzcal_plan_summary *summary,
                                       size_t size) PTZCAL_NOEXCEPT;

/**
 * Plans a scan in a site's surroundings.
 *
 * @param site    The site; its camera is a guess.
 * @param options What is wanted.
 * @param token   Stops it from another thread; may be NULL.
 * @param result  Receives the plan; free it with ptzcal_plan_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_UNREACHABLE when neither max_positions nor any number of shots
 *         reach the target (the message says which, and what limits it); PTZCAL_STATUS_DEGENERATE when
 *         the surroundings cannot determine the camera; PTZCAL_STATUS_NOT_FOUND when it sees nothing of
 *         the region; PTZCAL_STATUS_BAD_STATE for a site without surroundings;
 *         PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_CANCELLED;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plan_make(const ptzcal_site *site,
                               const ptzcal_plan_options *options,
                               const ptzcal_cancel *token,
                               ptzcal_plan **result,
                               ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * What a plan comes to.
 *
 * @param result  The plan.
 * @param summary Receives the summary; set up by ptzcal_plan_summary_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plan_get_summary(const ptzcal_plan *result,
                                      ptzcal_plan_summary *summary,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The chosen shots of a plan, the most valuable first.
 *
 * @param result   The plan.
 * @param buffer   Receives 5 numbers for each shot; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives their number; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_plan_copy_shots(const ptzcal_plan *result,
                                     double *buffer,
                                     size_t capacity,
                                     size_t *needed,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a plan.
 *
 * @param result The plan; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_plan_free(ptzcal_plan *result) PTZCAL_NOEXCEPT;

/**
 * Given what is scanned, where to shoot next so that the fixed camera's position becomes surer. Depths
 * at the candidates are predicted from the scanned ones, and so is whether the fixed camera sees them. With
 * a target the first shot may be a look at a place of which little is known, expected to save several shots
 * later. Asked after every shot, with the target, it needs fewest.
 *
 * @param site        The site; its camera is the best estimate so far. Surroundings are not used.
 * @param scanned     n shots of 4 numbers: pan and tilt as read (radians), measured depth along the
 *                    head's axis (metres), 1 when the fixed camera saw the spot, else 0.
 * @param n           Shots, 1 to 100,000.
 * @param candidates  Positions to choose from, 100,000 at most. Each is taken once before its depth is known;
 *                    one that the fixed camera saw may be shot again and again.
 * @param head_sigma  Noise of a spot in the head camera, px.
 * @param fixed_sigma Noise of a spot in the fixed camera, px.
 * @param target      Stops where the position's expected root mean square error is below, metres; 0: never.
 * @param count       Most shots to choose, at least 1.
 * @param now         Receives 2 numbers, the position's expected error from what is scanned: root mean
 *                    square and largest semi-axis, metres, both INFINITY while that does not determine the
 *                    camera; may be NULL.
 * @param buffer      Receives 5 numbers for each chosen shot, in the order to take them; may be NULL when
 *                    capacity is 0.
 * @param capacity    Numbers that fit; 5 count are always enough.
 * @param needed      Receives their number; may be NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FOUND when the fixed camera is expected to see none of the
 *         candidates; PTZCAL_STATUS_TOO_FEW_POINTS without a scanned shot; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_BUFFER_TOO_SMALL; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_next_shots(const ptzcal_site *site,
                                const double *scanned,
                                size_t n,
                                const ptzcal_region *candidates,
                                double head_sigma,
                                double fixed_sigma,
                                double target,
                                uint32_t count,
                                double *now,
                                double *buffer,
                                size_t capacity,
                                size_t *needed,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Pointing
 *
 * A pixel of a calibrated fixed camera as pan, tilt and zoom of the head, and a pixel of the head's
 * camera as a pixel of the fixed one (the next chapters). A pointing holds the camera, the rig, how well both are known, and
 * where the targets are: on a plane, on the surface of a point cloud, or at a distance. Every answer has
 * a covariance through the whole chain: click, calibration, surface, rig and the head's coming to rest.
 * ============================================================================================= */

/** Who measured a surface. */
enum {
  /** Anything else: its errors have nothing to do with the rig's. */
  PTZCAL_MEASURED_BY_OTHERS = 0,
  /**
   * The laser of the same rig, from where it stands now: what is wrong with the rig is wrong with the
   * surface too, and largely cancels when the rig aims at it.
   */
  PTZCAL_MEASURED_BY_THIS_RIG = 1,
};
typedef int32_t ptzcal_measured_by;

/** A fixed camera and a rig, for pointing. */
typedef struct ptzcal_pointing ptzcal_pointing;

/**
 * Makes a pointing of a camera whose world is the rig's frame. The rig is taken as exact until
 * ptzcal_pointing_set_rig_covariance; where the targets are must still be set.
 *
 * @param calibration The fixed camera with its covariance.
 * @param model       The rig.
 * @param pointing    Receives the pointing; free it with ptzcal_pointing_free.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT, PTZCAL_STATUS_NOT_FINITE,
 *         PTZCAL_STATUS_LENS_NOT_MONOTONE for a model that makes no sense.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_new(const ptzcal_calibration *calibration,
                                  const ptzcal_rig_model *model,
                                  ptzcal_pointing **pointing,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes a pointing of a joint adjustment, with all that camera and rig have in common.
 *
 * @param adjusted The adjustment's answer.
 * @param camera   The fixed camera's index.
 * @param station  The station at which the rig stands.
 * @param pointing Receives the pointing; free it with ptzcal_pointing_free.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a camera or station that does not
 *         exist.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_new_adjusted(const ptzcal_adjusted *adjusted,
                                           uint32_t camera,
                                           uint32_t station,
                                           ptzcal_pointing **pointing,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a pointing.
 *
 * @param pointing The pointing; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_pointing_free(ptzcal_pointing *pointing) PTZCAL_NOEXCEPT;

/**
 * Says how well the rig is known, independent of the camera.
 *
 * @param pointing   The pointing.
 * @param covariance 225 numbers, 15 x 15: of the rig's parameters in the order of
 *                   ptzcal_adjusted_copy_covariance, row-major, positive semi-definite.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_rig_covariance(ptzcal_pointing *pointing,
                                                 const double *covariance,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says where the rig stands, when that is not where the world is.
 *
 * @param pointing   The pointing.
 * @param pose       The station in the world, X_world = rotation X_station + translation; its other
 *                   members do not matter.
 * @param covariance 36 numbers, row-major: of w in R <- exp([w]x) R (axes of the world, radians) and
 *                   of the translation (metres); may be NULL: the pose is exact.
 * @param error      Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_station(ptzcal_pointing *pointing,
                                          const ptzcal_pose *pose,
                                          const double *covariance,
                                          ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says where the head comes to rest about its readings: its repeatability and, of a head with steps,
 * step / sqrt(12). 0 until then.
 *
 * @param pointing The pointing.
 * @param pan      Standard deviation of pan, radians.
 * @param tilt     Standard deviation of tilt, radians.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_head_deviation(ptzcal_pointing *pointing,
                                                 double pan,
                                                 double tilt,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Gives the head camera's lens over zoom: aims then have a zoom. Its errors are taken as independent
 * of the rig's axes and encoders.
 *
 * @param pointing The pointing.
 * @param curve    The curve, of the rig's image size; it is copied.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_zoom_curve(ptzcal_pointing *pointing,
                                             const ptzcal_zoom_curve *curve,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Says how far the head reaches: aims beyond are refused.
 *
 * @param pointing The pointing.
 * @param pan_min  Least reading of pan, radians.
 * @param pan_max  Greatest reading of pan, radians.
 * @param tilt_min Least reading of tilt, radians.
 * @param tilt_max Greatest reading of tilt, radians.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_reach(ptzcal_pointing *pointing,
                                        double pan_min,
                                        double pan_max,
                                        double tilt_min,
                                        double tilt_max,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The targets are on a plane n . x = distance of the world: the floor, the road, a wall.
 *
 * @param pointing    The pointing.
 * @param normal      3 numbers, of any length but 0.
 * @param distance    Metres times the normal's length.
 * @param covariance  16 numbers, 4 x 4 row-major, positive semi-definite: of the unit normal's three
 *                    components and the distance (metres); may be NULL: the plane is exact, but for
 *                    what `measured_by` makes of it.
 * @param measured_by A ptzcal_measured_by.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_plane(ptzcal_pointing *pointing,
                                        const double *normal,
                                        double distance,
                                        const double *covariance,
                                        uint32_t measured_by,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The targets are on the surface that a point cloud samples. The cloud is copied and arranged once: a
 * second or two for a million points.
 *
 * @param pointing    The pointing.
 * @param xyz         n x 3 numbers: points in the world, metres.
 * @param covariances n x 9 numbers: of each point, row-major, positive semi-definite, m^2; may be
 *                    NULL: estimated from the points' scatter.
 * @param n           Number of points, at least 4.
 * @param measured_by A ptzcal_measured_by.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_TOO_FEW_POINTS; PTZCAL_STATUS_NOT_FINITE (index: the
 *         point); PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_cloud(ptzcal_pointing *pointing,
                                        const double *xyz,
                                        const double *covariances,
                                        size_t n,
                                        uint32_t measured_by,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The targets are at a known distance along their rays, from whichever camera sees the pixel.
 *
 * @param pointing The pointing.
 * @param metres   The distance, positive.
 * @param sigma    Its standard deviation, metres; 0: exact.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_set_distance(ptzcal_pointing *pointing,
                                           double metres,
                                           double sigma,
                                           ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Pointing: aim and locate
 *
 * Where to turn the head for a pixel of the fixed camera, where the fixed camera sees what the head
 * camera sees, and the ellipse of a covariance.
 * ============================================================================================= */

/** Where to turn the head, and how surely. */
typedef struct ptzcal_aim {
  /** Set by ptzcal_aim_init. */
  uint32_t struct_size;
  /** 1 when there is a zoom curve, and `zoom` is set. */
  uint32_t has_zoom;
  /** 1 when the surface ends or bends about the target, or is sampled too thinly to tell: the target may be what is at `other_distance` instead. */
  uint32_t edge;
  /** 0. */
  uint32_t reserved;
  /** The device's reading at which the target is at the picture's centre, radians. */
  double pan;
  /** The device's reading, radians. */
  double tilt;
  /** Of the target's direction about them, in readings: pan pan, pan tilt, tilt tilt, rad^2. */
  double angle_covariance[3];
  /** The tightest zoom (the curve's own scale) that keeps the whole target in the picture with the probability asked for; the widest when none does. */
  double zoom;
  /** Of the whole target being in the picture. */
  double probability;
  /** Where the target is in the head camera's picture then, pixels. */
  double uv[2];
  /** Its covariance: xx, xy, yy, px^2. */
  double uv_covariance[3];
  /** The target in the world, metres. */
  double point[3];
  /** Its covariance, row-major, m^2. */
  double point_covariance[9];
  /** From the fixed camera's centre, metres. */
  double distance;
  /** From the fixed camera's centre, of what the target may be instead, metres; 0: the cloud shows nothing else. */
  double other_distance;
} ptzcal_aim;

/** Where the fixed camera sees what the head camera sees. */
typedef struct ptzcal_located {
  /** Set by ptzcal_located_init. */
  uint32_t struct_size;
  /** As in ptzcal_aim. */
  uint32_t edge;
  /** 1 when the cloud has a surface between the fixed camera and the point. */
  uint32_t hidden;
  /** 0. */
  uint32_t reserved;
  /** Pixel of the fixed camera. */
  double uv[2];
  /** Its covariance: xx, xy, yy, px^2. */
  double uv_covariance[3];
  /** In the world, metres. */
  double point[3];
  /** Its covariance, row-major, m^2. */
  double point_covariance[9];
  /** From the head camera's centre, metres. */
  double distance;
  /** As in ptzcal_aim, from the head camera's centre. */
  double other_distance;
} ptzcal_located;

/**
 * Sets up an aim: everything 0.
 *
 * @param aim  The struct.
 * @param size sizeof *aim.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_aim_init(ptzcal_aim *aim, size_t size) PTZCAL_NOEXCEPT;

/**
 * Sets up a location: everything 0.
 *
 * @param located The struct.
 * @param size    sizeof *located.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_located_init(ptzcal_located *located, size_t size) PTZCAL_NOEXCEPT;

/**
 * Where to turn the head, and how far to zoom, so that its camera shows at its picture's centre what the
 * fixed camera shows at a pixel.
 *
 * @param pointing      The pointing.
 * @param uv            2 numbers: a pixel of the fixed camera.
 * @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
 *                      exact.
 * @param probability   With which the whole target is to be in the picture, between 0 and 1.
 * @param target_size   Diameter of the target, metres; 0 for a point.
 * @param aim           Receives the aim; set up by ptzcal_aim_init.
 * @param error         Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT (a pixel outside the picture, a
 *         probability or size that is none); PTZCAL_STATUS_OUTSIDE_LENS; PTZCAL_STATUS_UNREACHABLE:
 *         a pixel above the plane's horizon, one so near to it that its distance is known to no
 *         better than 20 %, or an aim that the head cannot reach; PTZCAL_STATUS_NOT_FOUND: the cloud
 *         has no surface near the ray; PTZCAL_STATUS_BAD_STATE: neither plane nor cloud nor distance
 *         is set.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_aim(const ptzcal_pointing *pointing,
                                  const double *uv,
                                  const double *uv_covariance,
                                  double probability,
                                  double target_size,
                                  ptzcal_aim *aim,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Where the fixed camera sees what the head camera sees at a pixel.
 *
 * @param pointing      The pointing.
 * @param pan           Reading of the head, radians.
 * @param tilt          Reading of the head, radians.
 * @param zoom          Zoom on the curve's scale; without a curve it does not matter.
 * @param uv            2 numbers: a pixel of the head camera.
 * @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
 *                      exact.
 * @param located       Receives the location; set up by ptzcal_located_init.
 * @param error         Receives the error; may be NULL.
 * @return As ptzcal_pointing_aim; PTZCAL_STATUS_UNREACHABLE also for a point outside the fixed
 *         camera's picture, PTZCAL_STATUS_BEHIND_CAMERA for one that it cannot see.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_locate(const ptzcal_pointing *pointing,
                                     double pan,
                                     double tilt,
                                     double zoom,
                                     const double *uv,
                                     const double *uv_covariance,
                                     ptzcal_located *located,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The part of the fixed camera's picture in which what the head camera sees at a pixel can be, its depth
 * unknown: of 65 places evenly spread in inverse distance those that are in the picture, nearest first.
 *
 * @param pointing      The pointing.
 * @param pan           Reading of the head, radians.
 * @param tilt          Reading of the head, radians.
 * @param zoom          Zoom on the curve's scale; without a curve it does not matter.
 * @param uv            2 numbers: a pixel of the head camera.
 * @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
 *                      exact.
 * @param nearest       Metres, positive.
 * @param farthest      Metres; INFINITY is far enough.
 * @param buffer        Receives 6 numbers a place: distance from the head camera's centre (metres), u,
 *                      v, and xx, xy, yy of the pixel (px^2); may be NULL when capacity is 0.
 * @param capacity      Numbers that fit.
 * @param needed        Receives how many numbers there are; may be NULL.
 * @param error         Receives the error; may be NULL.
 * @return As ptzcal_pointing_locate; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_copy_located_along(const ptzcal_pointing *pointing,
                                                 double pan,
                                                 double tilt,
                                                 double zoom,
                                                 const double *uv,
                                                 const double *uv_covariance,
                                                 double nearest,
                                                 double farthest,
                                                 double *buffer,
                                                 size_t capacity,
                                                 size_t *needed,
                                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The ellipse about a Gaussian's mean that holds it with a probability: of a pixel, or of pan and tilt.
 *
 * @param covariance  3 numbers: xx, xy, yy, positive semi-definite.
 * @param probability Between 0 and 1.
 * @param semi_axes   Receives 2 numbers: the longer half axis and the shorter, in the covariance's
 *                    units.
 * @param angle       Receives the longer axis's angle from x towards y, radians, from -pi/2 to pi/2.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_ellipse(const double *covariance,
                             double probability,
                             double *semi_axes,
                             double *angle,
                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Pointing: depth unknown
 *
 * Where the head would have to look along the ray of a fixed camera's pixel whose depth is unknown: the
 * curve of pan and tilt, a zoom that shows all of it, or the steps that sweep it.
 * ============================================================================================= */

/** Where the target of a pixel may be. Immutable: any number of threads may read it. */
typedef struct ptzcal_sweep ptzcal_sweep;

/** What a sweep comes to. */
typedef struct ptzcal_sweep_summary {
  /** Set by ptzcal_sweep_summary_init. */
  uint32_t struct_size;
  /** Pictures that together show the whole curve; 1: one does. */
  uint32_t steps;
  /** Points of the curve. */
  uint32_t points;
  /** 1 when there is a zoom curve, and `zoom` is set. */
  uint32_t has_zoom;
  /** Least reading of pan on the curve, radians. */
  double pan_min;
  /** Greatest reading of pan, radians. */
  double pan_max;
  /** Least reading of tilt, radians. */
  double tilt_min;
  /** Greatest reading of tilt, radians. */
  double tilt_max;
  /** The middle of the range, radians. */
  double middle_pan;
  /** The middle of the range, radians. */
  double middle_tilt;
  /** The tightest zoom of one picture, the widest of several. */
  double zoom;
  /** Of the whole target being in one of the pictures, at the worst distance. */
  double probability;
} ptzcal_sweep_summary;

/**
 * Sets up a summary: everything 0.
 *
 * @param summary The struct.
 * @param size    sizeof *summary.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sweep_summary_init(ptzcal_sweep_summary *summary,
                                        size_t size) PTZCAL_NOEXCEPT;

/**
 * What to do about a pixel of the fixed camera whose depth is unknown, but for its nearest and farthest
 * distance from that camera.
 *
 * @param pointing      The pointing.
 * @param uv            2 numbers: a pixel of the fixed camera.
 * @param uv_covariance 3 numbers: xx, xy, yy, px^2, positive semi-definite; may be NULL: the pixel is
 *                      exact.
 * @param nearest       Metres, positive.
 * @param farthest      Metres; INFINITY is far enough.
 * @param probability   With which the whole target is to be in the picture, between 0 and 1.
 * @param target_size   Diameter of the target, metres; 0 for a point.
 * @param sweep         Receives the sweep; free it with ptzcal_sweep_free.
 * @param error         Receives the error; may be NULL.
 * @return As ptzcal_pointing_aim, but for what concerns the depth; PTZCAL_STATUS_INVALID_ARGUMENT
 *         for a range that is none.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_pointing_sweep(const ptzcal_pointing *pointing,
                                    const double *uv,
                                    const double *uv_covariance,
                                    double nearest,
                                    double farthest,
                                    double probability,
                                    double target_size,
                                    ptzcal_sweep **sweep,
                                    ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a sweep.
 *
 * @param sweep The sweep; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_sweep_free(ptzcal_sweep *sweep) PTZCAL_NOEXCEPT;

/**
 * What a sweep comes to.
 *
 * @param sweep   The sweep.
 * @param summary Receives the summary; set up by ptzcal_sweep_summary_init.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sweep_get_summary(const ptzcal_sweep *sweep,
                                       ptzcal_sweep_summary *summary,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The pictures that together show the whole curve, nearest first.
 *
 * @param sweep    The sweep.
 * @param buffer   Receives pan and tilt of each, radians; may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sweep_copy_steps(const ptzcal_sweep *sweep,
                                      double *buffer,
                                      size_t capacity,
                                      size_t *needed,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Pan and tilt over the distance, nearest first.
 *
 * @param sweep    The sweep.
 * @param buffer   Receives 6 numbers a point: distance from the fixed camera (metres), pan, tilt
 *                 (radians), and the covariance of the target's direction about them: pan pan, pan
 *                 tilt, tilt tilt (rad^2); may be NULL when capacity is 0.
 * @param capacity Numbers that fit.
 * @param needed   Receives how many numbers there are; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_sweep_copy_curve(const ptzcal_sweep *sweep,
                                      double *buffer,
                                      size_t capacity,
                                      size_t *needed,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Cameras in files of other programs
 *
 * One entry for all formats: ptzcal_camera_read and ptzcal_camera_write for one camera, a list with names
 * for the formats that hold several. A file is read whole or refused, with its line and key in the
 * message; what a format cannot hold (skew, the division model, k3 in Kalibr's) is refused with
 * PTZCAL_STATUS_UNSUPPORTED, never rounded to what it can.
 * ============================================================================================= */

/**
 * File formats of cameras. The lens is told by its own keys in each; all numbers are pixels, metres
 * and radians, as everywhere, whatever the format's own origin of pixels is.
 */
enum {
  /**
   * Reading: the file's content tells. Writing: the ending does: .json our own, .yaml and .yml OpenCV's,
   * .xml OpenCV's, .cameramodel mrcal's.
   */
  PTZCAL_CAMERA_FORMAT_AUTO = 0,
  /** Our own, to the last bit. One camera. */
  PTZCAL_CAMERA_FORMAT_JSON = 1,
  /**
   * OpenCV's FileStorage, with the keys of its calibration sample and the pose in two keys of our
   * own. One camera.
   */
  PTZCAL_CAMERA_FORMAT_OPENCV_YAML = 2,
  /** The same as XML. */
  PTZCAL_CAMERA_FORMAT_OPENCV_XML = 3,
  /** The same as JSON. */
  PTZCAL_CAMERA_FORMAT_OPENCV_JSON = 4,
  /** ROS's camera_info: lens and name of one camera. It has no pose. */
  PTZCAL_CAMERA_FORMAT_ROS = 5,
  /** The folder of a COLMAP model as text. Any number of cameras, an image each. */
  PTZCAL_CAMERA_FORMAT_COLMAP = 6,
  /** mrcal's .cameramodel. One camera. */
  PTZCAL_CAMERA_FORMAT_MRCAL = 7,
  /** Kalibr's camchain. Any number of cameras; the world is the first one's frame. */
  PTZCAL_CAMERA_FORMAT_KALIBR = 8,
};
typedef uint32_t ptzcal_camera_format;

/** Cameras with names. */
typedef struct ptzcal_camera_list ptzcal_camera_list;

/**
 * Reads the one camera of a file.
 *
 * @param path   The file; of COLMAP its folder.
 * @param format A ptzcal_camera_format.
 * @param camera Receives the camera; set up by ptzcal_camera_init. Its pose is the identity when the
 *               file has none.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the line
 *         and the key); PTZCAL_STATUS_FILE_VERSION; PTZCAL_STATUS_UNSUPPORTED for a lens that this
 *         library does not have; PTZCAL_STATUS_AMBIGUOUS for a file with several cameras.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_read(const char *path,
                                 uint32_t format,
                                 ptzcal_camera *camera,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes one camera. The file is at every moment the old one or the whole new one.
 *
 * @param camera The camera.
 * @param path   The file; of COLMAP its folder, which is made where it is not there.
 * @param format A ptzcal_camera_format.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_UNSUPPORTED for
 *         what the format cannot hold; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_write(const ptzcal_camera *camera,
                                  const char *path,
                                  uint32_t format,
                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Makes an empty list.
 *
 * @param list  Receives the list; free it with ptzcal_camera_list_free.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_new(ptzcal_camera_list **list,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a list.
 *
 * @param list The list; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_camera_list_free(ptzcal_camera_list *list) PTZCAL_NOEXCEPT;

/**
 * Adds a camera with its pose.
 *
 * @param list   The list.
 * @param camera The camera.
 * @param name   What files call it; may be NULL: it has no name.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_add(ptzcal_camera_list *list,
                                     const ptzcal_camera *camera,
                                     const char *name,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads all cameras of a file.
 *
 * @param path   The file; of COLMAP its folder.
 * @param format A ptzcal_camera_format.
 * @param list   Receives the list; free it with ptzcal_camera_list_free.
 * @param error  Receives the error; may be NULL.
 * @return As ptzcal_camera_read, for any number of cameras.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_read(const char *path,
                                      uint32_t format,
                                      ptzcal_camera_list **list,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes all cameras of a list into one file, or COLMAP's folder. COLMAP calls an image without a name
 * camera0, camera1, ...; names of its images have no white space.
 *
 * @param list   The list.
 * @param path   The file; of COLMAP its folder, which is made where it is not there.
 * @param format A ptzcal_camera_format.
 * @param error  Receives the error; may be NULL.
 * @return As ptzcal_camera_write (index: the camera); PTZCAL_STATUS_INVALID_ARGUMENT for an empty list
 *         and for several cameras in a format that holds one; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_write(const ptzcal_camera_list *list,
                                       const char *path,
                                       uint32_t format,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * How many cameras a list has, and the format that it was read from.
 *
 * @param list   The list.
 * @param count  Receives the number.
 * @param format Receives the ptzcal_camera_format, PTZCAL_CAMERA_FORMAT_AUTO for a list that was not
 *               read from a file; may be NULL.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_count(const ptzcal_camera_list *list,
                                       size_t *count,
                                       uint32_t *format,
                                       ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * A camera of a list.
 *
 * @param list     The list.
 * @param index    The camera, from 0.
 * @param camera   Receives the camera; set up by ptzcal_camera_init.
 * @param has_pose Receives 0 when the file did not say where the camera is, so that its pose is the
 *                 identity and means nothing, otherwise 1; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for no such camera; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_list_get(const ptzcal_camera_list *list,
                                     size_t index,
                                     ptzcal_camera *camera,
                                     uint32_t *has_pose,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Name of a camera of a list.
 *
 * @param list  The list; may be NULL.
 * @param index The camera, from 0.
 * @return A string that lives as long as the list; "" when the camera has no name or is not there;
 *         never NULL.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
const char *ptzcal_camera_list_name(const ptzcal_camera_list *list,
                                    size_t index) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Reports
 *
 * One HTML file that says what was measured and how good it is: cameras with their measurements,
 * residuals and uncertainties, scans with what was missed and why, surveys with their stations. It needs
 * no other file and no network, and prints as it looks. The same input makes the same bytes.
 * ============================================================================================= */

/** A report that grows. */
typedef struct ptzcal_report ptzcal_report;

/**
 * Begins a report.
 *
 * @param title  Its title, UTF-8.
 * @param report Receives the report; free it with ptzcal_report_free.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for text that is no UTF-8.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_new(const char *title,
                                ptzcal_report **report,
                                ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Frees a report.
 *
 * @param report The report; may be NULL: nothing happens.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
void ptzcal_report_free(ptzcal_report *report) PTZCAL_NOEXCEPT;

/**
 * Says which way is up in the world, for the view from above; without it -y, as in a rig's frame.
 *
 * @param report The report.
 * @param up     3 numbers, of any length but zero.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_NOT_FINITE; PTZCAL_STATUS_INVALID_ARGUMENT for a vector without
 *         a length; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_set_up(ptzcal_report *report,
                                   const double *up,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a paragraph of the host's own: who measured, when, where, with what.
 *
 * @param report The report.
 * @param note   The paragraph, UTF-8; it is shown as it is.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for text that is no UTF-8; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_note(ptzcal_report *report,
                                     const char *note,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a calibrated camera: parameters with standard deviations, warnings in words, and drawings of its
 * measurements and residuals, of depths, and of how far off a click may be.
 *
 * @param report      The report.
 * @param name        The camera's name, UTF-8.
 * @param calibration The calibration.
 * @param set         What it was calibrated from; may be NULL: then the drawings are left out.
 * @param picture     A picture of the camera's, of its size, drawn beneath the measurements; may be
 *                    NULL.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for a set of another calibration, a picture of
 *         another size, and a report beyond 256 MB; PTZCAL_STATUS_BUFFER_TOO_SMALL for the picture;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_calibration(ptzcal_report *report,
                                            const char *name,
                                            const ptzcal_calibration *calibration,
                                            const ptzcal_correspondences *set,
                                            const ptzcal_image *picture,
                                            ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a camera calibrated from boards: parameters with standard deviations, warnings in words, drawings
 * of its corners and residuals, every view, and what to add to make it better.
 *
 * @param report      The report.
 * @param name        The camera's name, UTF-8.
 * @param calibration The calibration.
 * @param boards      What it was calibrated from.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT for boards of another calibration and a report
 *         beyond 256 MB; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_board_calibration(ptzcal_report *report,
                                                  const char *name,
                                                  const ptzcal_board_calibration *calibration,
                                                  const ptzcal_boards *boards,
                                                  ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a scan: positions, who saw each spot and why not, depths.
 *
 * @param report The report.
 * @param name   The scan's name, UTF-8.
 * @param scan   The scan.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_scan(ptzcal_report *report,
                                     const char *name,
                                     const ptzcal_scan *scan,
                                     ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds a survey: rig, stations, planes, and each of its cameras as a section.
 *
 * @param report   The report.
 * @param name     The survey's name, UTF-8.
 * @param adjusted The survey, solved.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_adjusted(ptzcal_report *report,
                                         const char *name,
                                         const ptzcal_adjusted *adjusted,
                                         ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Names something that the result was made from by its SHA-256, such as the bytes of a journal or of a
 * rig's file. What is added above is named without being asked.
 *
 * @param report The report.
 * @param name   Its name, UTF-8.
 * @param bytes  n bytes; may be NULL when n is 0.
 * @param n      Number of bytes.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_INVALID_ARGUMENT; PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_add_input(ptzcal_report *report,
                                      const char *name,
                                      const uint8_t *bytes,
                                      size_t n,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * The report as HTML: UTF-8 without a NUL.
 *
 * @param report   The report.
 * @param buffer   Receives the text; may be NULL when capacity is 0.
 * @param capacity Bytes of the buffer.
 * @param needed   Receives the number of bytes; may be NULL.
 * @param error    Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_BUFFER_TOO_SMALL: needed says the size; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_copy_html(const ptzcal_report *report,
                                      char *buffer,
                                      size_t capacity,
                                      size_t *needed,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes the report as an HTML file, whole or not at all.
 *
 * @param report The report.
 * @param path   The file, UTF-8.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_report_save(const ptzcal_report *report,
                                 const char *path,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/* ================================================================================================
 * Files
 *
 * Calibrations, cameras, tables of points and clouds on disk. A file is written at once or not at all: on an error the old one, if
 * there was one, is still there.
 * ============================================================================================= */

/**
 * Writes a calibration as JSON: the camera, its covariance, the residuals and what else it says of
 * itself, every number to its last bit; of ptzcal_calibrate_camera also the measurements and options that
 * it was made from, so that ptzcal_calibration_load_inputs can solve it again.
 *
 * @param calibration The calibration.
 * @param path        The file.
 * @param error       Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_save(const ptzcal_calibration *calibration,
                                      const char *path,
                                      ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a camera alone as JSON.
 *
 * @param camera The camera.
 * @param path   The file.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_INVALID_ARGUMENT.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_save(const ptzcal_camera *camera,
                                 const char *path,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads the camera of a file written by ptzcal_camera_save or ptzcal_calibration_save.
 *
 * @param path   The file.
 * @param camera Receives the camera; set up by ptzcal_camera_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the
 *         key or the line); PTZCAL_STATUS_FILE_VERSION.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_load(const char *path,
                                 ptzcal_camera *camera,
                                 ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes a camera as OpenCV's YAML, with the pose in keys of our own.
 *
 * @param camera The camera: without skew, with no lens model or Brown-Conrady.
 * @param path   The file.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_UNSUPPORTED for what OpenCV's file
 *         cannot hold.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_save_opencv(const ptzcal_camera *camera,
                                        const char *path,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads a camera from OpenCV's YAML, XML or JSON. Without our keys its pose is the identity.
 *
 * @param path   The file.
 * @param camera Receives the camera; set up by ptzcal_camera_init.
 * @param error  Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT;
 *         PTZCAL_STATUS_UNSUPPORTED for lens models that this library does not have.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_camera_load_opencv(const char *path,
                                        ptzcal_camera *camera,
                                        ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Reads what a calibration was made from, out of a file of ptzcal_calibration_save. With the same version
 * of the library on the same kind of machine ptzcal_calibrate_camera makes the same calibration of it, to
 * the last bit.
 *
 * @param path    The file.
 * @param set     Receives the measurements; free them with ptzcal_correspondences_free.
 * @param options Receives the options; free them with ptzcal_calibration_options_free.
 * @param error   Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT; PTZCAL_STATUS_FILE_VERSION;
 *         PTZCAL_STATUS_NOT_FOUND for a camera without them; PTZCAL_STATUS_INVALID_ARGUMENT for
 *         measurements or options that are none.
 *
 * Threads: free.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_calibration_load_inputs(const char *path,
                                             ptzcal_correspondences **set,
                                             ptzcal_calibration_options **options,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Adds the points of a table of comma-separated values, all or none. Its first line names the columns, in
 * any order: x y z (metres, world) and u v (pixels). Optional: sigma_x sigma_y sigma_z (m), or cov_xx
 * cov_xy cov_xz cov_yy cov_yz cov_zz (m^2); sigma_u sigma_v (px), or cov_uu cov_uv cov_vv (px^2), each
 * group empty where a point has none; name and comment, which are passed over. So are lines that begin
 * with #. The last line has its end, or the file was cut short.
 *
 * @param set   The set.
 * @param path  The file.
 * @param added Receives the number of points; may be NULL.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_FILE_FORMAT (the message names the line
 *         and the column); PTZCAL_STATUS_INVALID_ARGUMENT for a covariance that is none;
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: exclusive.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_add_csv(ptzcal_correspondences *set,
                                             const char *path,
                                             size_t *added,
                                             ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes the points of a set as a table of comma-separated values, every number to its last bit: see
 * ptzcal_correspondences_add_csv.
 *
 * @param set   The set, of points only.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO; PTZCAL_STATUS_DISK_FULL; PTZCAL_STATUS_UNSUPPORTED for
 *         laser shots and lines, which are no points (ptzcal_calibration_save writes all kinds);
 *         PTZCAL_STATUS_BUSY.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_correspondences_save_csv(const ptzcal_correspondences *set,
                                              const char *path,
                                              ptzcal_error **error) PTZCAL_NOEXCEPT;

/**
 * Writes the measured points of a scan as binary PLY, with their colours and covariances:
 * ptzcal_cloud_from_scan and ptzcal_cloud_save in one.
 *
 * @param scan  The scan.
 * @param path  The file.
 * @param error Receives the error; may be NULL.
 * @return PTZCAL_STATUS_OK; PTZCAL_STATUS_FILE_IO.
 *
 * Threads: shared.
 * Since 0.1.0.
 */
ptzcal_status ptzcal_scan_save_ply(const ptzcal_scan *scan,
                                   const char *path,
                                   ptzcal_error **error) PTZCAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PTZCAL_H */
