//! Bakes roads in the live page, as WebAssembly: bytes in, bytes out.
//!
//! A caller puts what it asks for where [`room`] says, calls [`bake`], and finds what came of it, or an error's text,
//! where [`result`] says. After a panic, which ends the call, its text lies there too.

use std::cell::RefCell;

use offtrack_evaluation::live::bake;

thread_local! {
    static ASKED: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    // What a caller takes for the result before there is one tells what this is.
    static RESULT: RefCell<Vec<u8>> = RefCell::new(bake::STAMP.into());
}

/// Where `length` bytes of what is asked for belong, until the next call.
#[expect(unsafe_code, reason = "a name of a module's export is unmangled; no other has it")]
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    ASKED.with_borrow_mut(|asked| {
        *asked = vec![0; length];
        asked.as_mut_ptr()
    })
}

/// Bakes what is asked for, as [`bake::bake`] describes: whether it could.
#[expect(unsafe_code, reason = "a name of a module's export is unmangled; no other has it")]
#[unsafe(no_mangle)]
pub extern "C" fn bake() -> bool {
    std::panic::set_hook(Box::new(|panic| RESULT.set(panic.to_string().into())));
    let asked = ASKED.take();
    let baked = bake::bake(&asked);
    let is_baked = baked.is_ok();
    RESULT.set(baked.unwrap_or_else(|error| error.to_string().into()));
    is_baked
}

/// Where the result of the last call lies.
#[expect(unsafe_code, reason = "a name of a module's export is unmangled; no other has it")]
#[unsafe(no_mangle)]
pub extern "C" fn result() -> *const u8 {
    RESULT.with_borrow(|result| result.as_ptr())
}

/// The number of bytes of the result.
#[expect(unsafe_code, reason = "a name of a module's export is unmangled; no other has it")]
#[unsafe(no_mangle)]
pub extern "C" fn result_length() -> usize {
    RESULT.with_borrow(Vec::len)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a caller does, but that it needs no address here.
    fn called(asked: &str) -> (bool, Vec<u8>) {
        let _ = room(asked.len());
        ASKED.with_borrow_mut(|room| room.copy_from_slice(asked.as_bytes()));
        (bake(), RESULT.with_borrow(Vec::clone))
    }

    #[test]
    fn a_road_by_its_name_is_a_line_of_facts_and_the_bytes_that_they_tell_of() {
        let (is_baked, result) = called(r#"{"benchmark": {"name": "attard2023"}, "of": {"roads": "16m"}}"#);
        assert!(is_baked, "{}", String::from_utf8_lossy(&result));
        assert_eq!(result.len(), result_length());
        let end = result.iter().position(|&byte| byte == b'\n').unwrap();
        let facts: serde_json::Value = serde_json::from_slice(&result[..end]).unwrap();
        let lengths = facts["kinds"].as_array().unwrap().iter().map(|kind| kind[1].as_u64().unwrap() as usize);
        assert_eq!(lengths.sum::<usize>(), result.len() - end - 1);
    }

    #[test]
    fn what_is_wrong_is_the_readers_own_message() {
        let (is_baked, result) = called(r#"{"benchmark": {"name": "attard2023"}, "of": {"roads": "narrow/7/12"}}"#);
        let text = String::from_utf8(result).unwrap();
        let said = offtrack::map::procedural::find("narrow/7/12").unwrap_err().to_string();
        assert_eq!((is_baked, text), (false, said));
    }

    #[test]
    fn the_text_of_a_panic_is_the_result_of_its_call() {
        let (is_baked, _) = called("");
        assert!(!is_baked);
        // The hook stands since then.
        std::panic::catch_unwind(|| panic!("the fault")).unwrap_err();
        assert!(RESULT.with_borrow(|text| String::from_utf8_lossy(text).contains("the fault")));
    }
}
