use cathforce_reproduce::*;
fn main() {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let systems: Vec<_> = SYSTEMS.iter().filter(|s| names.iter().any(|n| n == s.name)).collect();
    let last = std::sync::atomic::AtomicU64::new(0);
    let report = reproduce(
        &systems,
        &|d, t| {
            let p = 20 * d / t.max(1);
            if last.swap(p, std::sync::atomic::Ordering::Relaxed) < p {
                eprintln!("{} %", 5 * p);
            }
        },
        &|| false,
    );
    println!("{}", serde_json::to_string_pretty(&report).unwrap());
}
