//! Functions of aarch64 on an emulated machine: a program of Linux is put round a function and its frames, and QEMU runs it.
//!
//! The program is a file in the Executable and Linking Format (System V ABI, chapters 4 and 5) with one segment: head, addresses, instructions, the function, constants,
//! frames. It calls the function on each frame and puts the frames out, and behind them what the caller has kept in d8 to d15.

use super::bits::TestNumber;
use super::encoding_aarch64::read;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Where the program is in memory.
const BASE: u64 = 0x40_0000;
/// Where the addresses stand, and 64 bytes further the first instruction.
const ADDRESSES: usize = 128;
/// What the caller has in d8 to d15: no number twice.
const KEPT: [u64; 8] = [0x3ff1, 0x3ff2, 0x3ff3, 0x3ff4, 0x3ff5, 0x3ff6, 0x3ff7, 0x3ff8];

/// The instructions, and how they read. x19: frames, x20: their end, x21: constants, x22: bytes of a frame, x23: the function, x24: the frame that it is called on.
const CALLER: [(u32, &str); 28] = [
    (0x10fffe09, "adr x9, 0xffffffffffffffc0"),
    (0xa9405133, "ldp x19, x20, [x9]"),
    (0xa9415935, "ldp x21, x22, [x9, #16]"),
    (0xf9401137, "ldr x23, [x9, #0x20]"),
    (0x6d402688, "ldp d8, d9, [x20]"),
    (0x6d412e8a, "ldp d10, d11, [x20, #16]"),
    (0x6d42368c, "ldp d12, d13, [x20, #32]"),
    (0x6d433e8e, "ldp d14, d15, [x20, #48]"),
    (0xaa1303f8, "orr x24, xzr, x19"),
    // the loop over frames
    (0xaa1803e0, "orr x0, xzr, x24"),
    (0xaa1503e1, "orr x1, xzr, x21"),
    (0xd63f02e0, "blr x23"),
    (0x8b160318, "add x24, x24, x22"),
    (0xeb14031f, "subs xzr, x24, x20"),
    (0x54ffff61, "b.ne 0xffffffffffffffec"),
    (0x6d002688, "stp d8, d9, [x20]"),
    (0x6d012e8a, "stp d10, d11, [x20, #16]"),
    (0x6d02368c, "stp d12, d13, [x20, #32]"),
    (0x6d033e8e, "stp d14, d15, [x20, #48]"),
    (0x91010294, "add x20, x20, #0x40"),
    // write(1, frames, length), exit(0)
    (0xd2800020, "movz x0, #0x1, lsl #0x0"),
    (0xaa1303e1, "orr x1, xzr, x19"),
    (0xcb130282, "sub x2, x20, x19"),
    (0xd2800808, "movz x8, #0x40, lsl #0x0"),
    (0xd4000001, "svc #0x0"),
    (0xd2800000, "movz x0, #0x0, lsl #0x0"),
    (0xd2800ba8, "movz x8, #0x5d, lsl #0x0"),
    (0xd4000001, "svc #0x0"),
];

#[test]
fn the_caller_is_read_as_what_it_is() {
    CALLER.iter().for_each(|(word, wanted)| assert_eq!(read(*word), *wanted));
}

/// What runs programs of aarch64.
pub struct Emulator(PathBuf);

impl Emulator {
    /// That of the toolchain for microcontrollers; says so where it is not there.
    pub fn find() -> Option<Emulator> {
        let named = std::env::var_os("STRAIGHTLINE_CROSS").map(PathBuf::from);
        let of_target = || Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("cross");
        let of_workspace = || Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("target").join("cross");
        let folders = named.map_or_else(|| vec![of_target(), of_workspace()], |named| vec![named]);
        let found = folders.into_iter().find(|folder| folder.join("complete").exists());
        if found.is_none() {
            eprintln!("skipped: there is no emulator of aarch64; robots/firmware/toolchain makes it");
        }
        found.map(|folder| Emulator(folder.join("run-aarch64")))
    }

    /// The frames when a function has run on each.
    pub fn run<T: TestNumber>(&self, function: &[u8], constants: &[T], frames: &[T], frame_length: usize) -> Vec<T> {
        static PROGRAMS: AtomicUsize = AtomicUsize::new(0);
        let name = format!("aarch64-{}-{}", std::process::id(), PROGRAMS.fetch_add(1, Ordering::Relaxed));
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let frames = bytes(frames);
        let program = program(function, &bytes(constants), &frames, frame_length * T::BYTES);
        std::fs::write(&path, program).expect("it can be written");
        mark_as_program(&path);
        let output = Command::new(&self.0).arg(&path).output().expect("the emulator starts");
        std::fs::remove_file(&path).expect("it was there");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && output.stdout.len() == frames.len() + 64, "{}: {said}", output.status);
        let (frames, kept) = output.stdout.split_at(frames.len());
        assert_eq!(kept, KEPT.map(u64::to_le_bytes).concat(), "the lower halves of v8 to v15 are the caller's");
        let number = |bytes: &[u8]| T::of_bits(bytes.iter().rev().fold(0, |bits, byte| bits << 8 | u64::from(*byte)));
        frames.chunks(T::BYTES).map(number).collect()
    }
}

/// As the emulator, like Linux, asks for it.
fn mark_as_program(path: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("it is ours");
    }
    let _ = path;
}

fn bytes<T: TestNumber>(numbers: &[T]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.bits().to_le_bytes().into_iter().take(T::BYTES)).collect()
}

fn program(function: &[u8], constants: &[u8], frames: &[u8], frame_bytes: usize) -> Vec<u8> {
    let mut file = vec![0; ADDRESSES + 64];
    let place = |file: &mut Vec<u8>, bytes: &[u8]| {
        file.resize(file.len().next_multiple_of(16), 0);
        file.extend(bytes);
        BASE + (file.len() - bytes.len()) as u64
    };
    let entry = place(&mut file, &CALLER.map(|(word, _)| word.to_le_bytes()).concat());
    let [function, constants, frames] = [function, constants, frames].map(|bytes| place(&mut file, bytes));
    // what is kept ends the frames
    let end = BASE + file.len() as u64;
    file.extend(KEPT.map(u64::to_le_bytes).concat());
    let addresses = [frames, end, constants, frame_bytes as u64, function];
    file[ADDRESSES..ADDRESSES + 40].copy_from_slice(&addresses.map(u64::to_le_bytes).concat());
    // 64 bits, lowest byte first, version 1; executable, of aarch64, version 1
    let mut head = b"\x7fELF\x02\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\xb7\0\x01\0\0\0".to_vec();
    // where it begins, where segments are described; no sections, no flags
    head.extend([entry, 64, 0].map(u64::to_le_bytes).concat());
    head.extend([0, 0, 64, 56, 1, 0, 0, 0].map(u16::to_le_bytes).concat());
    // a segment that is loaded, executed, written and read: the whole file
    head.extend([1, 7].map(u32::to_le_bytes).concat());
    let length = file.len() as u64;
    head.extend([0, BASE, BASE, length, length, 0x1_0000].map(u64::to_le_bytes).concat());
    file[..head.len()].copy_from_slice(&head);
    file
}
