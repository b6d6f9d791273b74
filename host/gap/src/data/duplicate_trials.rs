//! Finds trials that are copies of each other. A copied file is not a second run.

use cathforce_bundle::Trial;

/// The trials that are no copies of those before them, and a remark on each of the others.
///
/// Clocks may differ, readings not: no two runs read the same in every row, if only by the noise of the
/// sensors. Counted as a repeat, a copy would lower the floor; held out, it would have been seen.
pub fn without_copies(trials: &[Trial]) -> (Vec<&Trial>, Vec<String>) {
    let (mut own, mut remarks): (Vec<&Trial>, Vec<String>) = (Vec::new(), Vec::new());
    for trial in trials {
        match own.iter().find(|first| first.data == trial.data) {
            Some(first) => remarks.push(format!(
                "trial {:03} has the same readings as trial {:03} in every row: it is a copy and is left out",
                trial.number, first.number
            )),
            None => own.push(trial),
        }
    }
    (own, remarks)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cathforce_bundle::Bundle;

    use super::*;

    #[test]
    fn a_copy_is_left_out_whatever_its_clock_says_and_named_with_its_original() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none");
        let mut trials = Bundle::open(&example).unwrap().trials;
        let count = trials.len();
        let mut copy = trials[0].clone();
        copy.number = 90;
        copy.t_s.iter_mut().for_each(|t_s| *t_s += 3.0);
        trials.push(copy);
        let (own, remarks) = without_copies(&trials);
        assert_eq!(own.len(), count);
        assert!(
            matches!(&remarks[..], [only] if only.starts_with("trial 090 has the same readings as trial 000"))
        );
        assert_eq!(without_copies(&trials[..count]).1, Vec::<String>::new());
    }
}
