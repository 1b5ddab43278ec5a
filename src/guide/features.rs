//! Which features of rapier2d are supported, with the test of each.
//!
//! "As rapier" means: you set it with rapier's own builders and setters at any time, and the next step
//! uses it. A step refuses an unsupported feature by name with a
//! [`StepError`](crate::dynamics::StepError) and leaves the world unchanged. Tests are named by file
//! and function, `cargo test --release FILE::FUNCTION` runs one; a further test checks that each
//! exists.
//!
//! # Bodies
//! | rapier2d | here | tests |
//! |---|---|---|
//! | dynamic, fixed | as rapier | `rapier_seam::poses_and_velocities_are_written_back_to_bodies_and_colliders` |
//! | kinematic by velocity | as rapier; turns about its centre of mass | `bodies::a_body_driven_by_velocity_turns_about_its_centre` `rapier_seam::kinematic_bodies_push_and_are_not_pushed` |
//! | kinematic by position | as rapier; `linvel()` is not written, [`MoreauPipeline::velocity`] returns it | `bodies::a_platform_driven_by_position_carries_its_load` |
//! | change of kind | as rapier | `bodies::the_kind_of_a_body_can_change` |
//! | forces, torques, forces at a point | as rapier, until they are reset | `bodies::forces_and_torques_act_until_they_are_reset` `bodies::a_force_at_a_point_turns` |
//! | impulses | as rapier | `bodies::impulses_change_the_velocity_at_once` |
//! | gravity scale | as rapier | `bodies::gravity_scales` |
//! | linear and angular damping | `v̇ = −d v`, exact in free motion; rapier's is of first order in `dt` | `bodies::damping_is_exact_in_free_motion` `bodies::a_damped_body_at_rest_presses_with_its_weight` |
//! | locked axes | as rapier | `bodies::locked_axes_do_not_move` `bodies::axes_locked_by_the_user_count_in_the_next_step` |
//! | mass from colliders, additional mass, every change of it | counts in the next step; exact masses by [`MoreauPipeline::set_exact_mass`] | `bodies::every_change_of_mass_counts_in_the_next_step` `bodies::a_collider_moved_on_its_body_takes_the_centre_of_mass_along` `rapier_seam::an_exact_mass_counts_from_the_next_step_on` |
//! | dominance groups | as rapier; a joint between bodies of different dominance is refused | `dominance::the_higher_one_does_not_notice` `dominance::weight_stops_at_the_higher_one` `dominance::a_joint_between_bodies_of_different_dominance_is_refused` |
//! | teleporting, pushing, editing between steps | as rapier | `rapier_seam::a_body_that_the_user_moves_or_pushes_is_taken_over` |
//! | inserting and removing | as rapier; the handle of a removed object is refused | `rapier_seam::bodies_that_come_and_go_are_noticed` `bodies::handles_of_removed_bodies_are_refused` |
//! | enabling and disabling | as rapier | `bodies::disabled_bodies_are_not_there` `bodies::disabled_colliders_touch_nothing` |
//! | sleeping and waking | by rapier's activation settings; impulses are stored during sleep and used again | `sleeping::a_pyramid_falls_asleep_and_stands_still` `sleeping::a_woken_pyramid_does_not_move` `sleeping::what_changes_wakes_and_nothing_else` `sleeping::activation_settings_are_the_bodys_own` |
//! | islands at rest | awake, in every record, but neither detected nor solved until something about them changes | `resting::islands_at_rest_repeat_their_step` `resting::any_change_ends_the_rest` |
//! | CCD (`ccd_enabled`) | impacts of the body are located in time; scheme `staggered` only | `fast_bodies::bullets_stop_at_thin_walls` `fast_bodies::bullets_meet_each_other` `fast_bodies::nothing_passes_a_wall_that_rapier_would_stop` |
//! | soft CCD prediction | nothing to set: contacts that close within a step are always detected | `fast_bodies::soft_prediction_changes_nothing` |
//! | numbers that are not finite, masses that cannot be | refused by name, where rapier switches the body off | `bodies::states_that_are_not_finite_are_refused` `bodies::masses_that_cannot_be_are_refused` |
//!
//! # Colliders and contacts
//! | rapier2d | here | tests |
//! |---|---|---|
//! | ball, box, capsule, segment, triangle, convex polygon, half-space, round shapes | gaps in `f64`, good to 1e-15 m | `detection::gaps_agree_with_the_distance_that_parry_computes` `detection::gaps_are_exact_a_kilometre_from_the_origin` |
//! | polyline, oriented polyline, triangle mesh, height field, compound | piece by piece; bodies slide and tumble smoothly over the seams of a flat surface, where faces between flush parts of one body, of fixed bodies, or of bodies that rest beside each other, are no surface unless some collider has hooks; a mesh is met at its outline, or triangle by triangle where triangles overlap or share part of a side | `user_worlds::a_mesh_whose_triangles_share_part_of_a_side_is_met_at_its_border_only` `detection::the_tree_finds_what_trying_all_pairs_finds` `detection::nothing_stumbles_over_the_joints_of_a_flat_surface` `detection::a_joint_counts_once` `covers::tumbling_bodies_meet_no_face_between_flush_parts` `covers::a_face_is_met_when_what_covered_it_is_gone` `covers::a_thin_plate_stays_in_a_narrow_slot` |
//! | voxels; shapes of one's own | by their border, as a mesh; through parry, 3e-7 m for shapes of 1 m (1e-15 m with `f64`) | `features::a_box_rests_on_voxels` |
//! | contact skin | as rapier | `detection::skins_keep_surfaces_apart` |
//! | `set_shape`, colliders exchanged | the next step detects contacts with the new shape | `rapier_seam::a_shape_that_the_user_sets_is_met_where_it_is` `rapier_seam::a_collider_that_the_user_exchanges_is_met_where_it_is` |
//! | friction, restitution, combine rules | as rapier; the laws themselves are Coulomb's and Newton's | `rapier_seam::friction_and_restitution_combine_by_rapiers_rules` |
//! | collision groups, solver groups | as rapier | `rapier_seam::groups_and_sensors_let_bodies_through` `hooks::groups_that_do_not_push_still_tell` |
//! | sensors | intersections at the end of each step, where rapier takes those at its start; pairs by [`MoreauPipeline::intersections`] | `hooks::sensors_tell_what_enters_and_leaves_and_push_nothing` |
//! | contact softness, substeps, iterations, `contact_recycling` | change nothing: contacts are rigid, or compliant by [`SurfaceLaw`] | `features::rapiers_solver_settings_change_nothing` `detection::a_surface_law_given_later_counts` |
//! | impulses of a contact | in the record, and by handle from [`MoreauPipeline::results`]; rapier's contact graph has none | `results::impulses_are_the_change_of_momentum` `results::handles_are_those_of_the_world` |
//!
//! # Joints
//! | rapier2d | here | tests |
//! |---|---|---|
//! | revolute | rigid, of second order in `dt` | `joints::pins_of_a_double_pendulum_hold_at_order_two` `joints::pins_at_rest_hold_to_a_nanometre` `joints::pins_of_a_double_pendulum_do_not_drift_in_a_minute` |
//! | prismatic | as rapier, rigid | `joints::a_slider_on_an_incline_stands_on_its_limit_or_its_motor` |
//! | fixed | as rapier, rigid | `joints::a_fixed_joint_carries_force_and_moment` |
//! | rope | rigid where taut | `joints::a_rope_carries_the_weight_when_taut_and_nothing_when_slack` |
//! | spring | implicit, of second order, stable at any stiffness | `joints::a_spring_at_rest_is_stretched_by_the_weight` `joints::springs_and_dampers_converge_at_order_two_and_gain_nothing` |
//! | pin-slot | as rapier, rigid | `joints::a_pin_in_a_slot_carries_across_it_only` |
//! | limits | rigid; an overrun is closed by position | `joints::limits_of_a_pin_carry_a_lever_on_both_sides` `joints::a_lever_lands_on_its_limit_and_rests` `joints::a_limit_passed_at_the_start_is_closed_without_energy` |
//! | motors, by velocity or position, with a largest force | the spring and damper that rapier documents; without gains the speed is held | `joints::a_motor_holds_a_lever_and_gives_way_beyond_its_torque` `joints::a_position_motor_takes_the_shorter_way` `joints::a_motor_without_gain_holds_its_speed_as_in_rapier` |
//! | softness of a joint | makes springs of its locked axes | `joints::a_softness_of_its_own_makes_springs_of_locked_axes` |
//! | generic joints | any mix of locked, limited and driven axes; couplings other than a distance are refused | `joints::what_is_no_joint_is_refused_by_number_and_name` |
//! | impulses of a joint | in the record, part by part; rapier's `ImpulseJoint::impulses` is not written | `joints::a_motor_holds_a_lever_and_gives_way_beyond_its_torque` `joints::a_fixed_joint_carries_force_and_moment` |
//! | `contacts_enabled` of a joint | as rapier | `rapier_seam::jointed_bodies_touch_only_if_the_joint_lets_them` |
//! | multibody joints | refused: use impulse joints, which are as rigid here | `rapier_seam::unsupported_joints_are_refused_by_name` |
//!
//! # Hooks, events, queries
//! | rapier2d | here | tests |
//! |---|---|---|
//! | `filter_contact_pair`, `filter_intersection_pair` | by [`MoreauPipeline::step_with_events`] | `hooks::a_filter_lets_pass_what_it_forbids` |
//! | `modify_solver_contacts` | as rapier: one-way platforms, tangent velocity, friction, restitution, contacts taken away | `hooks::a_one_way_platform_is_passed_from_below_and_carries_from_above` `hooks::a_tangent_velocity_drives_as_in_rapier` `hooks::a_hook_sets_friction_and_takes_contacts_away` `hooks::a_hook_sets_restitution` |
//! | collision events | as rapier, started once and stopped once | `hooks::collisions_start_once_and_stop_once` `hooks::who_falls_asleep_touches_on` |
//! | contact force events | with our impulses over the step | `hooks::contact_forces_are_impulses_over_the_step` |
//! | ray casts, shape casts, point queries, character controllers; `contact_pairs`, `intersection_pairs` | rapier's, once [`MoreauPipeline::refresh_queries`] has updated them; **empty or out of date without it** | `user_worlds::a_character_stops_at_a_wall_once_queries_are_refreshed` `queries::queries_are_behind_until_they_are_refreshed` `queries::refreshing_changes_nothing` `queries::hooks_are_asked_which_pairs_to_leave_out` |
//! | `world.step()` after steps of ours | continues from the present state | `queries::rapiers_own_step_works_afterwards` |
//!
//! # The rest
//! | rapier2d | here | tests |
//! |---|---|---|
//! | serialisation | [`MoreauPipeline::state`] and [`MoreauPipeline::resume`], bit for bit; rapier's own types with the feature `serde-serialize` | `resume::what_is_resumed_goes_on_bit_for_bit` `resume::a_world_saved_as_text_goes_on_bit_for_bit` |
//! | rapier2d-f64 | feature `f64`; poses, velocities and masses are `f64` here in either case | `rapier_seam::a_box_rests_a_kilometre_from_the_origin` |
//! | determinism | the same bytes for the same run, with any number of threads | `resume::the_same_run_gives_the_same_bytes` `determinism::a_drum_tumbles_the_same_way_twice` `threads::every_number_of_threads_gives_the_same_bytes` |
//! | `parallel`, `simd8` | [`StepperSettings::threads`] distributes detection, islands and the sweeps of large heaps among threads, with the feature `parallel`; rapier's features change its own steps only | `threads::a_state_is_the_same_and_is_resumed_by_any_number` `determinism::a_pyramid_stands_the_same_way_twice` |
//! | variable step length | [`MoreauPipeline::step_by`]; zero is refused | `bodies::bad_step_lengths_are_refused` |
//! | long runs | memory is flat | `long_run::memory_is_flat_while_bodies_come_and_go` |
//! | soft bodies | refused | `rapier_seam::unsupported_joints_are_refused_by_name` |
//! | character controllers | rapier's own, on the world: refresh the queries first | `queries::a_character_stops_at_what_our_steps_have_moved` |
//!
//! [`MoreauPipeline::velocity`]: crate::rapier::MoreauPipeline::velocity
//! [`MoreauPipeline::set_exact_mass`]: crate::rapier::MoreauPipeline::set_exact_mass
//! [`MoreauPipeline::intersections`]: crate::rapier::MoreauPipeline::intersections
//! [`MoreauPipeline::results`]: crate::rapier::MoreauPipeline::results
//! [`MoreauPipeline::step_with_events`]: crate::rapier::MoreauPipeline::step_with_events
//! [`MoreauPipeline::step_by`]: crate::rapier::MoreauPipeline::step_by
//! [`MoreauPipeline::refresh_queries`]: crate::rapier::MoreauPipeline::refresh_queries
//! [`MoreauPipeline::state`]: crate::rapier::MoreauPipeline::state
//! [`MoreauPipeline::resume`]: crate::rapier::MoreauPipeline::resume
//! [`StepperSettings::threads`]: crate::dynamics::StepperSettings::threads
//! [`SurfaceLaw`]: crate::rapier::SurfaceLaw
