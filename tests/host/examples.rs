//! The examples run, and what they assert holds.

#[path = "../../host-tools/examples/anfis_on_a_table.rs"]
mod anfis_on_a_table;
#[path = "../../host-tools/examples/compare.rs"]
mod compare;
#[path = "../../host-tools/examples/diagnose_and_add.rs"]
mod diagnose_and_add;
#[path = "../../host-tools/examples/foreign_file.rs"]
mod foreign_file;
#[path = "../../host-tools/examples/identify.rs"]
mod identify;

#[test]
fn examples_hold() {
    anfis_on_a_table::main().unwrap();
    compare::main().unwrap();
    diagnose_and_add::main().unwrap();
    foreign_file::main().unwrap();
    identify::main().unwrap();
}
