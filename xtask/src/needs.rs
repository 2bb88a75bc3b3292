//! What the checks need beside Rust itself, and how a machine comes by it.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};

/// The microcontroller's target.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Something that a check needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Need {
    /// Rust's formatter.
    Rustfmt,
    /// Rust's linter.
    Clippy,
    /// Rust's core library for the microcontroller.
    Target,
    /// An emulator of the microcontroller's processor.
    Qemu,
    /// A browser and what lets a test drive it.
    Browser,
    /// What makes a book of the documentation.
    Book,
    /// What checks and bundles the page.
    Node,
    /// What the virtual board's processor is built with.
    BoardTools,
    /// What the Python package is tested with; what else it takes comes from Python's registry.
    Python,
    /// Finds what can be changed in the code.
    Mutants,
    /// Compares the public interface with that of an earlier version.
    SemverChecks,
}

impl Need {
    fn is_there(self) -> bool {
        match self {
            Self::Rustfmt => succeeds("cargo", &["fmt", "--version"]),
            Self::Clippy => succeeds("cargo", &["clippy", "--version"]),
            Self::Target => target_is_there(),
            Self::Qemu => on_path("qemu-system-arm"),
            Self::Browser => on_path("chromium") && on_path("chromedriver"),
            Self::Book => succeeds("mdbook", &["--version"]),
            Self::Node => on_path("node") && on_path("npm"),
            Self::BoardTools => on_path("cmake") && libclang_is_there(),
            Self::Python => succeeds("python3", &["-c", "import ensurepip, venv"]),
            Self::Mutants => succeeds("cargo", &["mutants", "--version"]),
            Self::SemverChecks => succeeds("cargo", &["semver-checks", "--version"]),
        }
    }

    /// What `rustup` is asked for.
    fn rustup(self) -> Option<[&'static str; 3]> {
        match self {
            Self::Rustfmt => Some(["component", "add", "rustfmt"]),
            Self::Clippy => Some(["component", "add", "clippy"]),
            Self::Target => Some(["target", "add", TARGET]),
            _ => None,
        }
    }

    /// What Cargo itself is asked to install.
    fn crates(self) -> &'static [&'static str] {
        match self {
            // Without what serves, watches and searches.
            Self::Book => &["mdbook@0.5.4", "--no-default-features"],
            Self::Mutants => &["cargo-mutants@27.1.0"],
            Self::SemverChecks => &["cargo-semver-checks"],
            _ => &[],
        }
    }

    /// Debian's packages.
    fn packages(self) -> &'static [&'static str] {
        match self {
            Self::Qemu => &["qemu-system-arm"],
            Self::Browser => &["chromium", "chromium-driver"],
            Self::Node => &["nodejs", "npm"],
            Self::BoardTools => &["cmake", "libclang-dev"],
            Self::Python => &["python3", "python3-venv"],
            _ => &[],
        }
    }
}

/// Installs what is missing, or says by which command to do it.
pub fn provide<'a>(needs: impl Iterator<Item = &'a Need>) -> Result<(), String> {
    let missing: BTreeSet<Need> = needs.copied().filter(|need| !need.is_there()).collect();
    for need in &missing {
        if let Some(arguments) = need.rustup() {
            run("rustup", &arguments)?;
        }
        if !need.crates().is_empty() {
            let arguments: Vec<&str> = ["install", "--locked"].iter().chain(need.crates()).copied().collect();
            run("cargo", &arguments)?;
        }
    }
    let packages: Vec<&str> = missing.iter().flat_map(|need| need.packages()).copied().collect();
    if !packages.is_empty() {
        install(&packages)?;
    }
    match missing.iter().find(|need| !need.is_there()) {
        None => Ok(()),
        Some(need) => Err(format!("{need:?} was installed but is not found; check PATH")),
    }
}

fn install(packages: &[&str]) -> Result<(), String> {
    let install: Vec<&str> = ["install", "-y", "--no-install-recommends"].iter().chain(packages).copied().collect();
    if !on_path("apt-get") {
        return Err(format!("install {} (Debian's names) and run this again", packages.join(", ")));
    }
    if !is_root() {
        let install = install.join(" ");
        return Err(format!("run `sudo apt-get update && sudo apt-get {install}` and then this again"));
    }
    run("apt-get", &["update"])?;
    run("apt-get", &install)
}

fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    let line = format!("{program} {}", arguments.join(" "));
    eprintln!("=== {line}");
    match Command::new(program).args(arguments).env("DEBIAN_FRONTEND", "noninteractive").status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}` ended with {status}; mend that and run this again")),
        Err(error) => Err(format!("`{line}` cannot be started ({error}); install {program} and run this again")),
    }
}

fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn on_path(program: &str) -> bool {
    std::env::var_os("PATH")
        .is_some_and(|path| std::env::split_paths(&path).any(|folder| folder.join(program).is_file()))
}

/// Rust's compiler names the folder of a target's libraries whether it is installed or not.
fn target_is_there() -> bool {
    let output = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
    output.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
}

/// Where LIBCLANG_PATH says, or Debian's packages put it.
fn libclang_is_there() -> bool {
    let holds = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.into_iter().any(|entry| entry.file_name().to_string_lossy().starts_with("libclang"))
    };
    let debians = std::fs::read_dir("/usr/lib").into_iter().flatten().flatten();
    let debians = debians.filter(|entry| entry.file_name().to_string_lossy().starts_with("llvm-"));
    std::env::var_os("LIBCLANG_PATH").is_some_and(|path| holds(Path::new(&path)))
        || debians.into_iter().any(|entry| holds(&entry.path().join("lib")))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
