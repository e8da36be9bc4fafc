//! The command line with the built-in component libraries.

fn main() -> std::process::ExitCode {
    davit::cli::main(davit::libraries::builtin())
}
