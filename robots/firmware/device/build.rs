//! Where the program lies in the machine's memory.

fn main() {
    println!("cargo::rerun-if-changed=memory");
    let target = std::env::var("TARGET").expect("cargo says for which platform");
    let layout = match target.as_str() {
        "thumbv6m-none-eabi" => "microbit.x",
        target if target.starts_with("thumb") => "mps2.x",
        // a program of Linux, as the emulator of these processors runs them
        _ => return,
    };
    let folder = std::env::var("CARGO_MANIFEST_DIR").expect("cargo says where the package is");
    println!("cargo::rustc-link-arg-bins=-T{folder}/memory/{layout}");
}
