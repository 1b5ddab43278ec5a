use std::process::ExitCode;

fn main() -> ExitCode {
    moreau2d::cli::main()
}
