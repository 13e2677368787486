/// \file
/// Physical effects that rigid geometry leaves out, each one an entry of a catalogue.
///
///     robot.effects.push_back(make_effect(effect_type("joint_compliance"), robot.chain, 1));  // of the second joint
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "llmt/robotics/effect_type.hpp"

namespace llmt::robotics {

/// The catalogue, in a fixed order; docs/effects.md prints it. Formulas, units and sources stand in the entries,
/// plausible ranges in the table robotics/catalogue.yaml; catalogue.hpp reads tables and effects of the user.
///
/// Angles in rad, lengths of the arm in m where forces are in N; L length, e unit chord of a link from its axis to the
/// next; F weight of everything beyond its end b, M the moment of that weight about b, w the link's own weight per
/// length; o_j, z_j origin and axis of joint j; p tool point. Loads act on the arm in
/// equilibrium where an effect is elastic (EffectType::elastic), else on the undeformed arm. In one pose, effects that
/// adjust payload or gravity come first, then loads are summed, then every effect is applied; displacements add up.
const std::vector<EffectType>& effect_types();

/// Throws std::invalid_argument listing the known names if there is none of that name.
const EffectType& effect_type(std::string_view name);

/// EffectType::nature of the effect's type.
Nature nature_of(const Effect& effect);

/// Index of the joint or link that an effect is at; 0 for the whole robot. Throws std::invalid_argument on an unknown
/// type, an unknown joint, wrong numbers of values or constants, constants that are out of range, or a place that does
/// not suit the effect, see suits().
std::size_t effect_index(const Chain& chain, const Effect& effect);

/// Whether an effect of that type may sit at that joint or link (0 for the whole robot); if not, `why` says why not.
bool suits(const EffectType& type, const Chain& chain, std::size_t index, std::string* why = nullptr);

/// An effect of that type with all values 0 at a joint, a link or (index 0) the whole robot. A user's own type becomes
/// an effect of type "formula". Without constants the usual ones are taken; `count` is the number of values of a list
/// of any length. Throws std::invalid_argument as effect_index().
Effect make_effect(const EffectType& type, const Chain& chain, std::size_t index, std::vector<double> constants = {},
                   std::size_t count = 1);

/// One entry for each of the effect's values: a list comes out as "values_1", "values_2", ...; units, keys and sizes
/// are those at its joint.
std::vector<EffectParameter> effect_parameters(const Chain& chain, const Effect& effect);

/// The same with the sizes and ranges of `type`, which may come from the user's catalogue; `effect` is of that type, as
/// made by make_effect().
std::vector<EffectParameter> effect_parameters(const EffectType& type, const Chain& chain, const Effect& effect);

/// The columns that an effect needs, numbers filled in; "a|b": one of them.
std::vector<std::string> effect_columns(const Chain& chain, const Effect& effect);

/// The names in "a|b", those of one of its entries, in the order in which they are looked for.
std::vector<std::string> alternatives(const std::string& columns);

/// "joint_compliance@joint2", "transmission_error@joint2[202]", "formula@joint2[belt]": type, place, constants. Unique
/// in a robot.
std::string effect_label(const Effect& effect);

/// "joint_compliance@joint2.compliance": the name under which an effect's parameter, one of effect_parameters(), is
/// calibrated.
std::string effect_parameter_name(const Effect& effect, const EffectParameter& parameter);

}  // namespace llmt::robotics
