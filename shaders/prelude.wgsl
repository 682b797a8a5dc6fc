// What every kernel begins with. Before it the host writes `alias real` and the sizes of the plan:
// CELLS, PLIES, SENSORS, PARTS and the constants of the tables.

// One, loaded at run time: see `keep`.
var<private> one: real;
// The member that this invocation carries.
var<private> member: u32;
