//! Rows of the files that a machine's run writes.

use crate::report::row;

row! {
    /// Wear of one cell after a number of cycles.
    WearRow in "wear.csv" {
        cycles: f64,
        hours: f64,
        bar: u32,
        cell: u32,
        x_m: f64,
        depth_m: f64,
        load_slip_nm_per_cycle: f64,
    }
}

row! {
    /// Worn volume of one cell after a number of cycles, per metre of width: its part of the area
    /// between the new profile and the worn one; the sum over the cells is that area.
    VolumeRow in "worn-volume.csv" {
        cycles: f64,
        hours: f64,
        bar: u32,
        cell: u32,
        volume_m3_per_m: f64,
    }
}

row! {
    /// One node of the worn profile after a number of cycles.
    ProfileRow in "profile.csv" {
        cycles: f64,
        hours: f64,
        bar: u32,
        node: u32,
        x_m: f64,
        y_m: f64,
    }
}

row! {
    /// Operation of the machine with one profile of its teeth: means over the measured revolutions,
    /// machine totals.
    OperationRow in "operation.csv" {
        /// Age of the teeth.
        cycles: f64,
        hours: f64,
        torque_nm: f64,
        /// Torque that keeps the cylinder's speed: above what the drive can give once it slows down.
        demand_nm: f64,
        speed_rad_s: f64,
        /// Power of the drive, and of the feeder: negative where it holds the crop back.
        drive_w: f64,
        feeder_w: f64,
        /// Winkler modulus of the crop.
        crop_stiffness_pa_m: f64,
        /// Crop in the machine over that of a strip laid end to end.
        crop_filled: f64,
        crop_out_kg_s: f64,
        /// Whether the crop passes and the drive keeps its speed.
        conveys: bool,
    }
}

row! {
    /// When and where a limit is crossed, with the error estimate. Cell 1 stands where none decides.
    LifeRow in "life.csv" {
        limit: String,
        hours: f64,
        cycles: f64,
        error_hours: f64,
        bar: u32,
        cell: u32,
    }
}

row! {
    /// Error of the hours to a limit from one source: a `bias` is the run minus the truth, a `bound`
    /// has no sign, `noise` is a standard deviation.
    ErrorRow in "life-error.csv" {
        limit: String,
        source: String,
        kind: String,
        hours: f64,
        /// Standard deviation of the source, or of the measured bias.
        noise_hours: f64,
        how: String,
    }
}

row! {
    /// Mean forces on one bar at one angle of the bar, machine totals.
    BarLoadRow in "bar-load.csv" {
        /// `new` or `worn`.
        teeth: String,
        angle_deg: f64,
        normal_n: f64,
        friction_n: f64,
    }
}

row! {
    /// One figure of the machine with grains and with the strip, machine totals.
    CropRow in "crops.csv" {
        figure: String,
        unit: String,
        grains: f64,
        strip: f64,
    }
}

row! {
    /// What a revolution does to one bar; the torque is a machine total.
    BarRow in "bars.csv" {
        crop: String,
        bar: u32,
        height_m: f64,
        torque_nm: f64,
        worn_m3_per_m_revolution: f64,
        deepest_cell: u32,
        deepest_m_per_revolution: f64,
    }
}

row! {
    /// What a revolution does to one node of the concave and its table.
    ConcaveRow in "concave-wear.csv" {
        crop: String,
        angle_deg: f64,
        width_m: f64,
        depth_m_per_revolution: f64,
    }
}

row! {
    /// Wear of one cell of a new tooth in a revolution, mean over the bars.
    CropWearRow in "wear-by-crop.csv" {
        crop: String,
        cell: u32,
        x_m: f64,
        depth_m_per_revolution: f64,
    }
}

row! {
    /// A published wear depth beside the computed one.
    ComparisonRow in "comparison.csv" {
        torque_nm: f64,
        omega_rad_s: f64,
        published_um: f64,
        computed_um: f64,
        relative_error: f64,
        /// Whether a constant was fitted to this point.
        calibrated: bool,
        /// When the base is worn through, if before the study's cycles: the depth is that of then.
        worn_through_cycles: f64,
    }
}

row! {
    /// Depth and life of the study's tooth at one friction, beside the published life.
    FrictionRow in "friction.csv" {
        friction: f64,
        torque_nm: f64,
        omega_rad_s: f64,
        computed_um: f64,
        /// To the highest limit of wear.
        life_hours: f64,
        published_hours: f64,
        /// As in `comparison.csv`.
        worn_through_cycles: f64,
    }
}

row! {
    /// Depth after the study's cycles at one friction and one torque, by the algebra, beside the published
    /// range.
    FrictionDepthRow in "friction-depth.csv" {
        friction: f64,
        torque_nm: f64,
        omega_rad_s: f64,
        computed_um: f64,
        /// Over cells or torques, the study does not say which.
        published_least_um: f64,
        published_most_um: f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Row;

    /// The headers as the interface document spells them.
    #[test]
    fn headers_are_those_of_the_interface() {
        fn header<R: Row>() -> String {
            R::HEADER.join(",")
        }
        assert_eq!(
            header::<WearRow>(),
            "cycles,hours,bar,cell,x_m,depth_m,load_slip_nm_per_cycle"
        );
        assert_eq!(
            header::<VolumeRow>(),
            "cycles,hours,bar,cell,volume_m3_per_m"
        );
        assert_eq!(header::<ProfileRow>(), "cycles,hours,bar,node,x_m,y_m");
        assert_eq!(
            header::<OperationRow>(),
            "cycles,hours,torque_nm,demand_nm,speed_rad_s,drive_w,feeder_w,crop_stiffness_pa_m,crop_filled,\
             crop_out_kg_s,conveys"
        );
        assert_eq!(
            header::<LifeRow>(),
            "limit,hours,cycles,error_hours,bar,cell"
        );
        assert_eq!(
            header::<ComparisonRow>(),
            "torque_nm,omega_rad_s,published_um,computed_um,relative_error,calibrated,\
             worn_through_cycles"
        );
        assert_eq!(
            header::<ErrorRow>(),
            "limit,source,kind,hours,noise_hours,how"
        );
        assert_eq!(
            header::<BarLoadRow>(),
            "teeth,angle_deg,normal_n,friction_n"
        );
        assert_eq!(
            header::<FrictionRow>(),
            "friction,torque_nm,omega_rad_s,computed_um,life_hours,published_hours,worn_through_cycles"
        );
    }
}
