//! How the firmware is linked; on the host there is nothing to do.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=src/bin/hot.x");
    println!("cargo:rerun-if-changed=src/bin/build_id.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let has = |feature: &str| std::env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    let mut arguments = vec!["--nmagic", "--build-id=sha1", "-Tsrc/bin/hot.x", "-Tlink.x", "-Tsrc/bin/build_id.x"];
    if has("NUCLEO_G474RE") {
        // Where defmt keeps its texts.
        arguments.push("-Tdefmt.x");
    }
    if has("MPS2_AN386") {
        // memory.x shifts the map by this symbol.
        arguments.push("--defsym=_mps2_an386=1");
    }
    for argument in arguments {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
