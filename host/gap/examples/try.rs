use cathforce_gap::*;
fn main(){ let b=cathforce_rig::Bundle::open(std::env::args().nth(1).unwrap()).unwrap();
 let d=drive::Drive::new(&b).unwrap(); let a=diagnose(&d,"x",&|_|{}); println!("{}\n{}\n{:?}\n{:?}",serde_json::to_string_pretty(&a).unwrap(),a.sentence(),a.details.path,a.details.held_out); }
