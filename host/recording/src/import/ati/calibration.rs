//! The calibration of a sensor that writes raw values, or values that disturb each other.

/// A force from a row's forces and torques: a row of the matrix for each axis \[N per unit of the log\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceCalibration([[f64; 6]; 3]);

impl ForceCalibration {
    /// From a table of numbers: three rows of three or six; the rows of the torques may follow.
    pub fn parse(text: &str) -> Result<Self, String> {
        let lines = (1..).zip(text.trim_start_matches('\u{feff}').lines());
        let lines = lines.filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let mut rows = Vec::new();
        for (line, text) in lines {
            let fields = text.split([',', ';', '\t', ' ']).map(str::trim).filter(|f| !f.is_empty());
            let number = |field: &str| field.parse::<f64>().ok().filter(|x| x.is_finite());
            let row = fields.map(|field| number(field).ok_or_else(|| field.to_owned()));
            let row = row
                .collect::<Result<Vec<_>, _>>()
                .map_err(|field| format!("line {line}: `{field}` is no number"))?;
            rows.push((line, row));
        }
        let columns = rows.first().map_or(0, |(_, row)| row.len());
        if let Some((line, row)) = rows.iter().find(|(_, row)| row.len() != columns) {
            return Err(format!(
                "line {line}: {} numbers, but {columns} in the first row",
                row.len()
            ));
        }
        if !matches!((rows.len(), columns), (3, 3) | (3 | 6, 6)) {
            return Err(format!(
                "line 1: {} rows of {columns} numbers are no calibration",
                rows.len()
            ));
        }
        let mut matrix = [[0.0; 6]; 3];
        for (own, (_, row)) in matrix.iter_mut().zip(&rows) {
            own.iter_mut().zip(row).for_each(|(own, number)| *own = *number);
        }
        if let Some((_, (line, _))) =
            matrix.iter().zip(&rows).find(|(row, _)| row.iter().all(|x| *x == 0.0))
        {
            return Err(format!("line {line}: this axis would have no force"));
        }
        Ok(Self(matrix))
    }

    /// Whether it needs the torques of a row.
    pub(super) fn has_torques(&self) -> bool {
        self.0.iter().any(|row| row[3..].iter().any(|x| *x != 0.0))
    }

    /// The force of a row \[N\].
    pub(super) fn apply(&self, values: [f64; 6]) -> [f64; 3] {
        self.0.map(|row| row.iter().zip(values).map(|(x, value)| x * value).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_rows_of_three_or_six_numbers_are_a_calibration() {
        let own =
            ForceCalibration::parse("# N per count\n0.01, 0, 0\n0 0.02 0\n0;0;-0.05\n").unwrap();
        assert!(!own.has_torques());
        assert_eq!(own.apply([100.0, 100.0, 100.0, 9.0, 9.0, 9.0]), [1.0, 2.0, -5.0]);
        let six = "1 0 0 0 0 2\n0 1 0 0 0 0\n0 0 1 0 0 0\n";
        let six = ForceCalibration::parse(&format!("{six}{six}")).unwrap();
        assert!(six.has_torques());
        assert_eq!(six.apply([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), [13.0, 2.0, 3.0]);
        for (text, says) in [
            ("", "0 rows"),
            ("1 0\n0 1\n", "2 rows of 2"),
            ("1 0 0\n0 1\n0 0 1\n", "line 2: 2 numbers, but 3"),
            ("1 0 0\n0 l 0\n0 0 1\n", "line 2: `l` is no number"),
            ("1 0 0\n0 0 0\n0 0 1\n", "line 2: this axis would have no force"),
        ] {
            let error = ForceCalibration::parse(text).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
