//! Which suitable nodes to tetrahedralize: the paper's Cost_TET < Cost_SAH (§3.2, §3.3).
