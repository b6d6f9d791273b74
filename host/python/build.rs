//! On macOS, a linker must be told that the interpreter's functions are found when Python loads the module.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
