//! The `snell` command.

fn main() {}
