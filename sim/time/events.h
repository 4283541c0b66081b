// Events of a run: friction that sticks or slips, stops and contacts that touch or part, expressions of the state that change their piece.
// Each ends a smooth piece of the equations of motion; event_watch.h locates it within the integrator's step, the phases change here, and
// the integration starts afresh.
#pragma once

#include "sim/time/system.h"

#include <string>
#include <vector>

namespace flexframe::sim {

// Whether the scene has anything that makes events.
bool has_events(const System& system);
// How fast the bodies turn whose frames expressions and contacts read, rad/s, at the present velocities; 0 where nothing reads.
double watched_turning(const System& system);

// Margins at (t, y): every entry is positive while the present phases hold. Entries: friction points, then two a stop, then the switches of
// expressions (signals.h), then three a contact (contacts.h).
int event_count(const System& system);
void event_margins(System& system, double t, const double* y, double* margin);
// Of the margins at the state in `work`, their rates where they are known: of contacts that are apart; elsewhere not a number.
void event_rates(const System& system, double* rate);
// What rounding leaves of a margin that is zero, in its unit, at the state in `work`; follows FrictionState::fastest.
void event_roundings(System& system, std::vector<double>& rounding);

// Sets the phases that hold at (t, y): all at the start of a run (first), what sticks and the stops after a jump of the loads.
// The state's size may change.
void start_phases(System& system, double t, const VecX& y, bool first, std::vector<std::string>& changes);

// Changes the phases whose margin came to zero from above, those with directions[k] < 0 (event_watch.h). False where none did. True:
// `system` holds the new state, to be packed; its size may have changed.
// seen: the state in which they were found to end, which tells what has come to rest; y: the same, or nearer to the truth.
// released: energy that friction of contacts lets go, J.
bool pass_events(System& system, double t, const VecX& seen, const VecX& y, const std::vector<int>& directions,
                 std::vector<std::string>& changes, double& released);

// Contacts that have come to rest at the state in `system.work`, time t, begin with the friction that leaves their surfaces without
// acceleration, as far as it may hold, and so do those beside them that barely slide. Returns the energy that their springs begin with, J.
double hold_contacts(System& system, double t, std::vector<int> resting, std::vector<std::string>& changes);

}  // namespace flexframe::sim
