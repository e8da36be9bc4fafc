//! The command line with the built-in component libraries.

// Tens of thousands of small things are made at once when a deployment comes up, in several threads.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    davit::main(davit::builtin())
}
