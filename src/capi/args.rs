//! Limits
//!
//! Sizes above these are refused with PTZCAL_STATUS_INVALID_ARGUMENT.

use std::ffi::{c_char, c_void};

use crate::error::{Error, Result};

/// Most elements (points, shots, frames, numbers of a buffer) that one argument may have. It keeps
/// every product of sizes from overflowing, and an uninitialised count from being believed.
pub const PTZCAL_MAX_COUNT: usize = 268435456;

/// Longest string that is accepted, in bytes, its NUL not counted.
pub const PTZCAL_MAX_STRING: usize = 4096;

/// Marks what C may hand over as bytes: every pattern is a value.
///
/// # Safety
/// Numbers and arrays of numbers only.
pub(super) unsafe trait Plain: Copy {}
// SAFETY: numbers.
unsafe impl Plain for u8 {}
// SAFETY: numbers.
unsafe impl Plain for u16 {}
// SAFETY: numbers.
unsafe impl Plain for u32 {}
// SAFETY: numbers.
unsafe impl Plain for u64 {}
// SAFETY: numbers.
unsafe impl Plain for i32 {}
// SAFETY: numbers.
unsafe impl Plain for f32 {}
// SAFETY: numbers.
unsafe impl Plain for f64 {}
// SAFETY: numbers.
unsafe impl Plain for usize {}
// SAFETY: pointers are numbers until they are followed.
unsafe impl Plain for *const c_void {}
// SAFETY: an array of plain values is plain.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

/// Checks an array argument without touching its memory. NULL is fine for no elements.
fn check_array<T>(ptr: *const T, n: usize, name: &'static str) -> Result<()> {
    if n > PTZCAL_MAX_COUNT {
        return Err(Error::invalid(name, format!("{n} elements, {PTZCAL_MAX_COUNT} are the most")));
    }
    if n > 0 && ptr.is_null() {
        return Err(Error::NullPointer { name });
    }
    if !ptr.is_aligned() {
        return Err(Error::invalid(name, format!("the pointer is not a multiple of {} bytes", align_of::<T>())));
    }
    Ok(())
}

/// `n` elements at `ptr`; it may be NULL when `n` is 0.
///
/// # Safety
/// `n` elements are readable, and nobody writes to them, until `'a` ends.
pub(super) unsafe fn array<'a, T: Plain>(ptr: *const T, n: usize, name: &'static str) -> Result<&'a [T]> {
    check_array(ptr, n, name)?;
    if n == 0 {
        return Ok(&[]);
    }
    // SAFETY: checked above; the rest is this function's contract. The size fits by PTZCAL_MAX_COUNT.
    Ok(unsafe { std::slice::from_raw_parts(ptr, n) })
}

/// `n` vectors of `N` finite numbers; the index of an error is the vector's.
///
/// # Safety
/// As for [`array`], with n x N numbers.
pub(super) unsafe fn vectors<'a, const N: usize>(
    ptr: *const f64,
    n: usize,
    name: &'static str,
) -> Result<&'a [[f64; N]]> {
    // SAFETY: by this function's contract.
    let vectors = unsafe { array(ptr.cast::<[f64; N]>(), n, name)? };
    match vectors.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
        Some(index) => Err(Error::NotFinite { name, index }),
        None => Ok(vectors),
    }
}

/// Like [`vectors`], `None` for NULL.
///
/// # Safety
/// As for [`vectors`].
pub(super) unsafe fn vectors_optional<'a, const N: usize>(
    ptr: *const f64,
    n: usize,
    name: &'static str,
) -> Result<Option<&'a [[f64; N]]>> {
    // SAFETY: by this function's contract.
    if ptr.is_null() { Ok(None) } else { unsafe { vectors(ptr, n, name) }.map(Some) }
}

/// A finite number.
pub(super) fn number(value: f64, name: &'static str) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(Error::NotFinite { name, index: 0 }) }
}

/// 0 or 1.
pub(super) fn flag(value: u32, name: &'static str) -> Result<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Error::invalid(name, format!("{value} is neither 0 nor 1"))),
    }
}

/// A NUL-terminated UTF-8 string of at most PTZCAL_MAX_STRING bytes.
///
/// # Safety
/// `ptr` is NULL, or readable up to its NUL or for PTZCAL_MAX_STRING + 1 bytes, until `'a` ends.
pub unsafe fn string<'a>(ptr: *const c_char, name: &'static str) -> Result<&'a str> {
    if ptr.is_null() {
        return Err(Error::NullPointer { name });
    }
    let ptr = ptr.cast::<u8>();
    let length = (0..=PTZCAL_MAX_STRING)
        // SAFETY: every byte before this one was not NUL, so this one is readable.
        .find(|i| unsafe { *ptr.add(*i) } == 0)
        .ok_or_else(|| Error::invalid(name, format!("no NUL within {} bytes", PTZCAL_MAX_STRING + 1)))?;
    // SAFETY: `length` bytes were just read.
    let bytes = unsafe { std::slice::from_raw_parts(ptr, length) };
    std::str::from_utf8(bytes).map_err(|e| Error::invalid(name, format!("not UTF-8 at byte {}", e.valid_up_to())))
}

/// A copy of a string; `None` for NULL.
///
/// # Safety
/// As for [`string`].
pub(super) unsafe fn string_optional(ptr: *const c_char, name: &'static str) -> Result<Option<String>> {
    // SAFETY: by this function's contract.
    if ptr.is_null() { Ok(None) } else { unsafe { string(ptr, name) }.map(|s| Some(s.to_owned())) }
}

/// Where one value goes.
pub(super) struct Out<T>(*mut T);

impl<T: Plain> Out<T> {
    /// # Safety
    /// `ptr` is NULL or writable until the call ends.
    pub unsafe fn new(ptr: *mut T, name: &'static str) -> Result<Self> {
        check_array(ptr, 1, name)?;
        Ok(Self(ptr))
    }

    /// `None` for NULL.
    ///
    /// # Safety
    /// As for [`Out::new`].
    pub unsafe fn optional(ptr: *mut T, name: &'static str) -> Result<Option<Self>> {
        // SAFETY: by this function's contract.
        if ptr.is_null() { Ok(None) } else { unsafe { Self::new(ptr, name) }.map(Some) }
    }

    pub fn write(self, value: T) {
        // SAFETY: not NULL, aligned, and writable by the contract of `new`.
        unsafe { self.0.write(value) }
    }
}

/// Where exactly `n` elements go.
pub(super) struct ArrayOut<T> {
    ptr: *mut T,
    n: usize,
}

impl<T: Plain> ArrayOut<T> {
    /// # Safety
    /// `n` elements at `ptr` are writable until the call ends (it may be NULL when `n` is 0).
    pub unsafe fn new(ptr: *mut T, n: usize, name: &'static str) -> Result<Self> {
        check_array(ptr, n, name)?;
        Ok(Self { ptr, n })
    }

    /// Writes the first `n` of `values`.
    pub fn write(self, values: &[T]) {
        let n = self.n.min(values.len());
        if n > 0 {
            // SAFETY: `n` elements are writable by the contract of `new`; `values` has as many.
            unsafe { std::ptr::copy(values.as_ptr(), self.ptr, n) };
        }
    }
}

impl ArrayOut<f64> {
    /// The same place as `n` vectors of `N` numbers.
    ///
    /// # Safety
    /// As for [`ArrayOut::new`], with n x N numbers.
    pub unsafe fn vectors<const N: usize>(ptr: *mut f64, n: usize, name: &'static str) -> Result<ArrayOut<[f64; N]>> {
        // SAFETY: by this function's contract.
        unsafe { ArrayOut::new(ptr.cast(), n, name) }
    }

    /// Like [`vectors`](Self::vectors), `None` for NULL.
    ///
    /// # Safety
    /// As for [`ArrayOut::vectors`].
    pub unsafe fn vectors_optional<const N: usize>(
        ptr: *mut f64,
        n: usize,
        name: &'static str,
    ) -> Result<Option<ArrayOut<[f64; N]>>> {
        // SAFETY: by this function's contract.
        if ptr.is_null() { Ok(None) } else { unsafe { Self::vectors(ptr, n, name) }.map(Some) }
    }
}

/// Output of a size that the caller may not know: (buffer, capacity, needed).
pub(super) struct BufferOut<T> {
    place: ArrayOut<T>,
    needed: *mut usize,
}

impl<T: Plain> BufferOut<T> {
    /// # Safety
    /// `capacity` elements at `buffer` are writable until the call ends (it may be NULL when
    /// `capacity` is 0); `needed` is NULL or writable.
    pub unsafe fn new(buffer: *mut T, capacity: usize, needed: *mut usize) -> Result<Self> {
        // SAFETY: by this function's contract.
        Ok(Self { place: unsafe { ArrayOut::new(buffer, capacity, "buffer")? }, needed })
    }

    /// Writes all `values` or none; `needed` is told in both cases.
    pub fn write(self, values: &[T]) -> Result<()> {
        let (needed, capacity) = (values.len(), self.place.n);
        if !self.needed.is_null() {
            // SAFETY: writable by the contract of `new`.
            unsafe { self.needed.write(needed) };
        }
        if needed > capacity {
            return Err(Error::BufferTooSmall { needed, capacity });
        }
        self.place.write(values);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    #[test]
    fn strings_are_bounded_utf8() {
        let text = |bytes: &[u8]| {
            // SAFETY: every case has a NUL or is longer than the limit.
            unsafe { string(bytes.as_ptr().cast(), "path").map(str::to_owned) }
        };
        assert_eq!(text("sim:room \u{e9}\0".as_bytes()).unwrap(), "sim:room \u{e9}");
        assert_eq!(text(b"\0").unwrap(), "");
        assert_eq!(text(b"ab\xff\0").unwrap_err().to_string(), "path: not UTF-8 at byte 2");
        let mut long = vec![b'x'; PTZCAL_MAX_STRING + 1];
        assert_eq!(text(&long).unwrap_err().status(), Status::InvalidArgument);
        long[PTZCAL_MAX_STRING] = 0;
        assert_eq!(text(&long).unwrap().len(), PTZCAL_MAX_STRING);
        // SAFETY: NULL is refused.
        assert_eq!(unsafe { string(std::ptr::null(), "path") }.unwrap_err().status(), Status::NullPointer);
    }

    #[test]
    fn arrays_are_checked_before_they_are_read() {
        let numbers = [1.0, 2.0, f64::NAN, 4.0];
        let p = numbers.as_ptr();
        // SAFETY: the array has four numbers; the other cases are refused before a read.
        unsafe {
            assert_eq!(vectors::<2>(p, 1, "uv").unwrap(), &[[1.0, 2.0]]);
            assert_eq!(vectors::<2>(p, 2, "uv").unwrap_err(), Error::NotFinite { name: "uv", index: 1 });
            assert_eq!(vectors::<2>(std::ptr::null(), 1, "uv").unwrap_err().status(), Status::NullPointer);
            assert!(vectors::<2>(std::ptr::null(), 0, "uv").unwrap().is_empty());
            for n in [PTZCAL_MAX_COUNT + 1, usize::MAX / 16 + 1, usize::MAX] {
                assert_eq!(vectors::<2>(p, n, "uv").unwrap_err().status(), Status::InvalidArgument);
            }
            let odd = p.cast::<u8>().add(1).cast::<f64>();
            assert_eq!(array(odd, 1, "uv").unwrap_err().status(), Status::InvalidArgument);
        }
    }

    #[test]
    fn a_buffer_is_filled_whole_or_not_at_all() {
        let mut buffer = [0u32; 3];
        let mut needed = 0;
        // SAFETY: three numbers are there, or none are written.
        unsafe {
            let e = BufferOut::new(buffer.as_mut_ptr(), 2, &mut needed).unwrap().write(&[7, 8, 9]).unwrap_err();
            assert_eq!((e, needed), (Error::BufferTooSmall { needed: 3, capacity: 2 }, 3));
            assert_eq!(buffer, [0; 3]);
            BufferOut::new(buffer.as_mut_ptr(), 3, std::ptr::null_mut()).unwrap().write(&[7, 8, 9]).unwrap();
            assert_eq!(buffer, [7, 8, 9]);
            let null = std::ptr::null_mut::<u32>();
            assert!(BufferOut::new(null, 0, &mut needed).unwrap().write(&[1]).is_err());
            assert_eq!(needed, 1);
            assert_eq!(BufferOut::new(null, 1, &mut needed).err().unwrap().status(), Status::NullPointer);
        }
    }
}
