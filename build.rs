//! Finds the system's Embree 3 or 4 and compiles `ffi/embree_shim.c` against it, if feature `embree` is on.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    leave_out();
    #[cfg(feature = "embree")]
    embree::compile_shim();
    #[cfg(feature = "bindgen")]
    bindings::generate();
}

/// Tells the compiler which features to leave out: see `src/facts.rs`.
fn leave_out() {
    println!("cargo::rerun-if-env-changed=SNELL_WITHOUT");
    println!("cargo::rustc-check-cfg=cfg(snell_less)");
    println!("cargo::rustc-check-cfg=cfg(snell_without, values(any()))");
    let without = std::env::var("SNELL_WITHOUT").unwrap_or_default();
    for name in without.split(',').filter(|name| !name.is_empty()) {
        println!("cargo::rustc-cfg=snell_less");
        println!("cargo::rustc-cfg=snell_without=\"{name}\"");
    }
}

#[cfg(feature = "embree")]
mod embree {
    use std::env;
    use std::path::{Path, PathBuf};
    use std::process::Command;

    /// Where the compiler and the linker look anyway, so that neither a path nor an rpath is needed.
    const SYSTEM_PREFIX: &str = "/usr";

    /// Prefixes of package managers.
    const PREFIXES: [&str; 5] =
        [SYSTEM_PREFIX, "/usr/local", "/opt/homebrew", "/opt/local", "/home/linuxbrew/.linuxbrew"];

    /// Versions that the shim knows, the better one first.
    const MAJORS: [u32; 2] = [4, 3];

    /// A header with its library.
    struct Embree {
        major: u32,
        include: PathBuf,
        library: PathBuf,
        is_system: bool,
    }

    impl Embree {
        fn library_file(&self) -> PathBuf {
            self.library.join(library_name(self.major))
        }
    }

    pub(crate) fn compile_shim() {
        println!("cargo::rerun-if-changed=ffi/embree_shim.c");
        println!("cargo::rerun-if-changed=ffi/embree_shim.h");
        println!("cargo::rerun-if-changed=ffi/embree_packet.h");
        let found = match find() {
            Ok(found) => found,
            Err(tried) => return fail(&tried),
        };
        let mut build = cc::Build::new();
        build.file("ffi/embree_shim.c").std("c11").warnings(true);
        build.define("SNELL_EMBREE_MAJOR", found.major.to_string().as_str());
        if !found.is_system {
            // As a system path, so that warnings in Embree's headers stay Embree's.
            build.flag("-isystem").flag(found.include.to_str().unwrap_or_default());
            println!("cargo::rustc-link-search=native={}", found.library.display());
            if env::var("CARGO_CFG_TARGET_FAMILY").is_ok_and(|family| family == "unix") {
                println!("cargo::rustc-link-arg=-Wl,-rpath,{}", found.library.display());
            }
        }
        // Another Embree in the same place has to be compiled against anew.
        let headers = found.include.join(format!("embree{}", found.major));
        for file in [headers.join("rtcore_config.h"), headers.join("rtcore.h"), found.library_file()] {
            println!("cargo::rerun-if-changed={}", file.display());
        }
        if let Err(error) = build.try_compile("embree_shim") {
            let message = format!("ffi/embree_shim.c does not compile against {}: {error}", found.include.display());
            println!("cargo::error={}", message.replace('\n', " "));
            return;
        }
        println!("cargo::rustc-link-lib=dylib=embree{}", found.major);
    }

    /// Looks in EMBREE_DIR, or if it is not set asks pkg-config, then follows CMake's variables, then looks in the usual
    /// places. Fails with the list of all that it tried.
    fn find() -> Result<Embree, Vec<String>> {
        let mut tried = Vec::new();
        if let Some(dir) = variable("EMBREE_DIR") {
            return in_prefix(Path::new(&dir), "EMBREE_DIR", &mut tried).ok_or(tried);
        }
        by_pkg_config(&mut tried)
            .or_else(|| by_cmake(&mut tried))
            .or_else(|| PREFIXES.iter().find_map(|prefix| in_prefix(Path::new(prefix), "", &mut tried)))
            .ok_or(tried)
    }

    fn variable(name: &str) -> Option<String> {
        println!("cargo::rerun-if-env-changed={name}");
        env::var(name).ok().filter(|value| !value.is_empty())
    }

    /// Debian and Embree itself ship no .pc file, but some packagers add one.
    fn by_pkg_config(tried: &mut Vec<String>) -> Option<Embree> {
        variable("PKG_CONFIG_PATH");
        for name in ["embree4", "embree3", "embree"] {
            let answer = Command::new("pkg-config").args(["--variable=prefix", name]).output();
            let Ok(answer) = answer else {
                tried.push("pkg-config (not installed)".into());
                return None;
            };
            let prefix = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
            if answer.status.success() && !prefix.is_empty() {
                if let Some(found) = in_prefix(Path::new(&prefix), "pkg-config", tried) {
                    return Some(found);
                }
            } else {
                tried.push(format!("pkg-config {name}"));
            }
        }
        None
    }

    /// `embree_DIR` is the folder of embree-config.cmake, at <prefix>/lib…/cmake/embree-x.y.z.
    fn by_cmake(tried: &mut Vec<String>) -> Option<Embree> {
        if let Some(dir) = variable("embree_DIR") {
            let mut ancestors = Path::new(&dir).ancestors();
            if let Some(found) = ancestors.find_map(|prefix| in_prefix(prefix, "embree_DIR", tried)) {
                return Some(found);
            }
        }
        let prefixes = variable("CMAKE_PREFIX_PATH")?;
        env::split_paths(&prefixes).find_map(|prefix| in_prefix(&prefix, "CMAKE_PREFIX_PATH", tried))
    }

    fn in_prefix(prefix: &Path, source: &str, tried: &mut Vec<String>) -> Option<Embree> {
        let found = MAJORS.iter().find_map(|&major| {
            let include = prefix.join("include");
            let has_header = include.join(format!("embree{major}/rtcore.h")).is_file();
            let library = library_dirs(prefix).into_iter().find(|dir| dir.join(library_name(major)).is_file())?;
            has_header.then(|| Embree { major, include, library, is_system: prefix == Path::new(SYSTEM_PREFIX) })
        });
        if found.is_none() {
            let source = if source.is_empty() { String::new() } else { format!(" ({source})") };
            tried.push(format!("{}{source}", prefix.display()));
        }
        found
    }

    fn library_dirs(prefix: &Path) -> Vec<PathBuf> {
        let arch = env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default();
        let arch = if arch == "x86" { "i386".to_owned() } else { arch };
        ["lib".to_owned(), "lib64".to_owned(), format!("lib/{arch}-linux-gnu")].map(|dir| prefix.join(dir)).to_vec()
    }

    fn library_name(major: u32) -> String {
        let os = env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
        match os.as_str() {
            "macos" => format!("libembree{major}.dylib"),
            "windows" => format!("embree{major}.lib"),
            _ => format!("libembree{major}.so"),
        }
    }

    /// Says all there is to say in one message. Cargo stops for it, and without an exit code of failure adds no noise.
    fn fail(tried: &[String]) {
        println!(
            "cargo::error=Embree 3 or 4 was not found: no include/embree4/rtcore.h or include/embree3/rtcore.h with its \
             library in {}. Install it (Debian, Ubuntu: apt install libembree-dev; Fedora: dnf install embree-devel; \
             Arch: pacman -S embree; Homebrew: brew install embree), or set EMBREE_DIR to the folder that holds its \
             include and lib, or build without it: cargo build --no-default-features",
            tried.join(", ")
        );
    }
}

#[cfg(feature = "bindgen")]
mod bindings {
    use std::env;
    use std::path::Path;

    /// Writes the bindings of our header to OUT_DIR, where tests/bindings.rs compares them with those in the tree, and if
    /// UPDATE_BINDINGS is set to the tree.
    pub(crate) fn generate() {
        println!("cargo::rerun-if-env-changed=UPDATE_BINDINGS");
        println!("cargo::rerun-if-changed=ffi/embree_shim.h");
        let out = env::var_os("OUT_DIR").expect("cargo sets OUT_DIR");
        let bindings = bindgen::Builder::default()
            .header("ffi/embree_shim.h")
            .allowlist_item("(rt|RT)_.*")
            .raw_line("//! Bindings of ffi/embree_shim.h, made by bindgen. Do not edit: see tests/bindings.rs.")
            .raw_line("")
            .use_core()
            .merge_extern_blocks(true)
            .default_macro_constant_type(bindgen::MacroTypeVariation::Unsigned)
            .disable_header_comment()
            .generate()
            .expect("ffi/embree_shim.h is C that libclang understands");
        bindings.write_to_file(Path::new(&out).join("bindings.rs")).expect("OUT_DIR can be written");
        if env::var_os("UPDATE_BINDINGS").is_some() {
            bindings.write_to_file("src/accel/embree/bindings.rs").expect("the tree can be written");
        }
    }
}
