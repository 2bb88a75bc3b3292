//! How the program for the emulated board is linked; on the host there is nothing to do.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // The memory map is the firmware's, ../../memory.x, shifted by this symbol: the linker prefers that file to any
        // other of its name.
        for argument in ["--defsym=_mps2_an386=1", "--defsym=_large=1", "--nmagic", "-Tlink.x"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}
