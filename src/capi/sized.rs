//! Plain-data structs that begin with their own size, so that they can grow without breaking a
//! program compiled against an older or a newer header.

use crate::error::{Error, Result};

/// Above this a `struct_size` is garbage from a struct that was never set up.
const MAX_SIZE: usize = 1 << 14;

/// # Safety
/// The type is `repr(C)`, its first member is `struct_size: u32`, and every pattern of bytes is a
/// valid value of it (numbers, raw pointers, arrays of them; no enum, bool or reference).
pub(super) unsafe trait SizedStruct: Copy {
    /// For messages.
    const NAME: &'static str;
    /// Its size when it was first released: the least that is accepted. Never changes.
    const FIRST_SIZE: usize;
    /// What `_init` sets.
    fn initial() -> Self;
}

fn check_size<T: SizedStruct>(size: usize) -> Result<usize> {
    if size < T::FIRST_SIZE || size > MAX_SIZE {
        let reason = format!("struct_size {size} is impossible: set it up with _init(x, sizeof *x)");
        return Err(Error::invalid(T::NAME, reason));
    }
    Ok(size)
}

/// The caller's `struct_size`, checked.
///
/// # Safety
/// `ptr` is NULL or has at least 4 readable bytes.
unsafe fn caller_size<T: SizedStruct>(ptr: *const T) -> Result<usize> {
    if ptr.is_null() {
        return Err(Error::NullPointer { name: T::NAME });
    }
    // SAFETY: not NULL; `struct_size` is the first member. No alignment is assumed.
    check_size::<T>(unsafe { ptr.cast::<u32>().read_unaligned() } as usize)
}

/// `_init`: the initial value, zeros behind it (for members that this version does not know), and
/// the caller's size.
///
/// # Safety
/// `ptr` is NULL or has `size` writable bytes.
pub(super) unsafe fn init<T: SizedStruct>(ptr: *mut T, size: usize) -> Result<()> {
    if ptr.is_null() {
        return Err(Error::NullPointer { name: T::NAME });
    }
    let size = check_size::<T>(size)?;
    let value = T::initial();
    // SAFETY: `size` bytes are writable, and no more than size_of::<T>() are read from `value`.
    unsafe {
        ptr.cast::<u8>().write_bytes(0, size);
        copy(&value, ptr, 0, size.min(size_of::<T>()));
        ptr.cast::<u32>().write_unaligned(size as u32);
    }
    Ok(())
}

/// A copy of the caller's struct: members that an older caller does not have keep their initial
/// value; members that this version does not know must be zero, because what they ask for would not
/// be done.
///
/// # Safety
/// `ptr` is NULL or has as many readable bytes as its `struct_size` says.
pub(super) unsafe fn read<T: SizedStruct>(ptr: *const T) -> Result<T> {
    let (size, known) = (unsafe { caller_size(ptr)? }, size_of::<T>());
    let mut value = T::initial();
    // SAFETY: `size` bytes are readable; `value` has `known`, and every pattern of bytes is a value.
    let unknown = unsafe {
        copy(ptr, &mut value, size_of::<u32>(), size.min(known));
        std::slice::from_raw_parts(ptr.cast::<u8>().add(size.min(known)), size - size.min(known))
    };
    if unknown.iter().any(|b| *b != 0) {
        return Err(Error::Unsupported {
            what: format!("{}: a member that is newer than this library is set (struct_size {size})", T::NAME),
        });
    }
    Ok(value)
}

/// Where a struct goes.
pub(super) struct SizedOut<T> {
    ptr: *mut T,
    size: usize,
}

impl<T: SizedStruct> SizedOut<T> {
    /// # Safety
    /// `ptr` is NULL or has as many writable bytes, until the call ends, as its `struct_size` says.
    pub unsafe fn new(ptr: *mut T) -> Result<Self> {
        // SAFETY: by this function's contract.
        let size = unsafe { caller_size(ptr)? };
        Ok(Self { ptr, size })
    }

    /// Writes the members that the caller has; `struct_size` stays the caller's.
    pub fn write(self, value: &T) {
        // SAFETY: writable by the contract of `new`; no more than size_of::<T>() are read.
        unsafe { copy(value, self.ptr, size_of::<u32>(), self.size.min(size_of::<T>())) };
    }
}

/// Copies the bytes from..to of a struct.
///
/// # Safety
/// `source` and `target` have at least `to` bytes and do not overlap.
unsafe fn copy<T>(source: *const T, target: *mut T, from: usize, to: usize) {
    // SAFETY: by this function's contract; bytes have no alignment.
    unsafe { std::ptr::copy_nonoverlapping(source.cast::<u8>().add(from), target.cast::<u8>().add(from), to - from) };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    /// The struct as this library knows it: released with `a`, grown by `b`.
    #[derive(Debug, Clone, Copy, PartialEq)]
    #[repr(C)]
    struct Now {
        struct_size: u32,
        a: u32,
        b: u32,
    }

    // SAFETY: numbers only, `struct_size` first.
    unsafe impl SizedStruct for Now {
        const NAME: &'static str = "now";
        const FIRST_SIZE: usize = 8;
        fn initial() -> Self {
            Self { struct_size: 12, a: 5, b: 6 }
        }
    }

    #[test]
    fn an_older_caller_is_never_written_past_its_size() {
        let mut memory = [0xAAAA_AAAAu32; 4];
        let ptr = memory.as_mut_ptr().cast::<Now>();
        // SAFETY: 16 bytes are there.
        unsafe {
            init(ptr, 8).unwrap();
            assert_eq!(read(ptr).unwrap(), Now { struct_size: 12, a: 5, b: 6 });
            SizedOut::new(ptr).unwrap().write(&Now { struct_size: 12, a: 1, b: 2 });
        }
        assert_eq!(memory, [8, 1, 0xAAAA_AAAA, 0xAAAA_AAAA]);
    }

    #[test]
    fn a_newer_caller_is_understood_until_it_asks_for_more() {
        let mut memory = [0xAAAA_AAAAu32; 5];
        let ptr = memory.as_mut_ptr().cast::<Now>();
        // SAFETY: 20 bytes are there.
        unsafe {
            init(ptr, 16).unwrap();
            assert_eq!(memory, [16, 5, 6, 0, 0xAAAA_AAAA]);
            SizedOut::new(ptr).unwrap().write(&Now { struct_size: 12, a: 1, b: 2 });
            assert_eq!(memory, [16, 1, 2, 0, 0xAAAA_AAAA]);
            assert_eq!(read(ptr).unwrap().b, 2);
            memory[3] = 1;
            assert_eq!(read(memory.as_ptr().cast::<Now>()).unwrap_err().status(), Status::Unsupported);
        }
    }

    #[test]
    fn impossible_sizes_are_refused() {
        let mut now = Now::initial();
        // SAFETY: refused before anything is touched.
        unsafe {
            for size in [0, 4, 7, MAX_SIZE + 1, usize::MAX] {
                assert_eq!(init(&mut now, size).unwrap_err().status(), Status::InvalidArgument);
            }
            assert_eq!(init(std::ptr::null_mut::<Now>(), 12).unwrap_err().status(), Status::NullPointer);
        }
        assert_eq!(now, Now::initial());
    }
}
