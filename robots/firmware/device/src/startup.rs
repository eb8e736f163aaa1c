//! The beginning of the program on a machine without an operating system, and how it says something: the one module with `unsafe`, as both
//! are instructions that no safe function has.
//!
//! On Arm's microcontrollers: the table of vectors, the floating-point unit switched on, and semihosting (Arm's document
//! "Semihosting for AArch32 and AArch64"), which debuggers and emulators answer. On RISC-V and 64-bit Arm: a program of Linux, with its calls
//! `write` and `exit`, as user-mode emulators run them.
#![allow(unsafe_code)]

use core::panic::PanicInfo;

/// Prints a name and a number in hexadecimal digits, as a line.
pub fn say(name: &str, number: u32) {
    put(name.as_bytes());
    let mut line = *b" 00000000\n";
    for (i, digit) in line[1..9].iter_mut().enumerate() {
        *digit = match (number >> (28 - 4 * i)) as u8 & 15 {
            low @ 0..=9 => b'0' + low,
            high => b'a' + high - 10,
        };
    }
    put(&line);
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    put(b"panic\n");
    exit(1)
}

/// What begins with the machine goes on here.
extern "C" fn start() -> ! {
    crate::run();
    exit(0)
}

#[cfg(target_arch = "arm")]
mod machine {
    use core::arch::{asm, global_asm};

    // the first two words are the stack and the beginning, the next are exceptions, of which there should be none
    global_asm!(
        ".section .vector_table,\"a\",%progbits",
        ".word __stack_top",
        ".word Reset",
        ".rept 14",
        ".word Halt",
        ".endr",
        ".text",
        ".thumb_func",
        ".global Reset",
        "Reset:",
        "bl {enable}",
        "bl {start}",
        ".thumb_func",
        "Halt:",
        "b Halt",
        enable = sym enable,
        start = sym super::start,
    );

    /// Switches the floating-point unit on, where there is one.
    #[cfg(target_abi = "eabihf")]
    extern "C" fn enable() {
        // SAFETY: the register of access to coprocessors, at its place in all processors of this architecture (Arm v7-M, B3.2.20)
        unsafe {
            let control = 0xe000_ed88 as *mut u32;
            control.write_volatile(control.read_volatile() | 0xf << 20);
            asm!("dsb", "isb");
        }
    }

    #[cfg(not(target_abi = "eabihf"))]
    extern "C" fn enable() {}

    fn semihosting(operation: u32, argument: usize) {
        // SAFETY: the emulator or debugger reads what the argument says, and changes r0 alone
        unsafe { asm!("bkpt #0xab", inout("r0") operation => _, in("r1") argument, options(nostack)) }
    }

    pub fn put(text: &[u8]) {
        const WRITE_CHARACTER: u32 = 3;
        text.iter().for_each(|byte| semihosting(WRITE_CHARACTER, core::ptr::from_ref(byte) as usize));
    }

    pub fn exit(code: u32) -> ! {
        const EXIT: u32 = 0x18;
        const STOPPED: usize = 0x20026;
        const FAILED: usize = 0x20023;
        semihosting(EXIT, if code == 0 { STOPPED } else { FAILED });
        loop {}
    }
}

#[cfg(any(target_arch = "riscv32", target_arch = "aarch64"))]
mod machine {
    use core::arch::{asm, global_asm};

    // Linux has made the stack
    #[cfg(target_arch = "riscv32")]
    global_asm!(".global _start", "_start:", "call {start}", start = sym super::start);
    #[cfg(target_arch = "aarch64")]
    global_asm!(".global _start", "_start:", "bl {start}", start = sym super::start);

    fn call(number: usize, [a, b, c]: [usize; 3]) {
        // SAFETY: `write` reads what it is given, `exit` nothing; the result is not used
        #[cfg(target_arch = "riscv32")]
        unsafe {
            asm!("ecall", in("a7") number, inout("a0") a => _, in("a1") b, in("a2") c, options(nostack))
        }
        #[cfg(target_arch = "aarch64")]
        unsafe {
            asm!("svc #0", in("x8") number, inout("x0") a => _, in("x1") b, in("x2") c, options(nostack))
        }
    }

    pub fn put(text: &[u8]) {
        const WRITE: usize = 64;
        call(WRITE, [1, text.as_ptr() as usize, text.len()]);
    }

    pub fn exit(code: u32) -> ! {
        const EXIT: usize = 93;
        call(EXIT, [code as usize, 0, 0]);
        loop {}
    }
}

use machine::{exit, put};
