//! What the browser calls: memory for a request, and the answer to it. Strings cross as UTF-8, with their lengths; there is no other type.
//!
//! This is the one place with `unsafe`, as exported names and memory that a caller owns leave no choice.
#![allow(unsafe_code)]

use crate::request::answer;

/// Memory for so many bytes, which the caller fills.
#[no_mangle]
pub extern "C" fn alloc(length: usize) -> *mut u8 {
    let bytes = vec![0u8; length].into_boxed_slice();
    Box::into_raw(bytes).cast()
}

/// The answer to a request, both names as [`alloc`] gave their memory, which is taken back: the address of its length, which 4 bytes hold, and which the
/// answer follows. It stays until the next call.
///
/// # Safety
/// Both pairs are of `alloc`, filled, and not used again.
#[no_mangle]
pub unsafe extern "C" fn call(name: *mut u8, name_length: usize, request: *mut u8, request_length: usize) -> *const u8 {
    let taken = |at: *mut u8, length: usize| unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(at, length)) };
    let (name, request) = (taken(name, name_length), taken(request, request_length));
    let found = answer(&String::from_utf8_lossy(&name), &request);
    let length = u32::try_from(found.len()).expect("memory of 32 bits");
    ANSWER.with_borrow_mut(|kept| {
        *kept = length.to_le_bytes().into_iter().chain(found).collect();
        kept.as_ptr()
    })
}

thread_local! {
    static ANSWER: std::cell::RefCell<Vec<u8>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// What a panic said, if the last call ended in one: the address of its length and text, as of answers.
#[no_mangle]
pub extern "C" fn last_panic() -> *const u8 {
    PANIC.with_borrow(|kept| kept.as_ptr())
}

thread_local! {
    static PANIC: std::cell::RefCell<Vec<u8>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// Remembers what panics say: called once, first.
#[no_mangle]
pub extern "C" fn start() {
    std::panic::set_hook(Box::new(|panic| {
        let text = panic.to_string();
        let length = text.len() as u32;
        PANIC.with_borrow_mut(|kept| *kept = length.to_le_bytes().into_iter().chain(text.into_bytes()).collect());
    }));
}
