// Con rod of a one-cylinder engine, metres. Big end at the origin, small end at (0.15, 0, 0), bores along z.
SetFactory("OpenCASCADE");
Cylinder(1) = {0, 0, -0.012, 0, 0, 0.024, 0.042};      // big eye
Cylinder(2) = {0.15, 0, -0.012, 0, 0, 0.024, 0.022};   // small eye
Box(3) = {0, -0.014, -0.009, 0.15, 0.028, 0.018};      // shank
BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2, 3}; Delete; };
Cylinder(5) = {0, 0, -0.02, 0, 0, 0.04, 0.029};        // bores
Cylinder(6) = {0.15, 0, -0.02, 0, 0, 0.04, 0.013};
Box(7) = {0.048, -0.009, 0.003, 0.074, 0.018, 0.02};   // pockets of the I section
Box(8) = {0.048, -0.009, -0.023, 0.074, 0.018, 0.02};
BooleanDifference(9) = { Volume{4}; Delete; }{ Volume{5, 6, 7, 8}; Delete; };
Physical Volume("ROD") = {9};
// The bores' surfaces, found by their boxes (a cylinder's surface is the only one within them).
big() = Surface In BoundingBox{-0.0295, -0.0295, -0.0125, 0.0295, 0.0295, 0.0125};
small() = Surface In BoundingBox{0.1365, -0.0135, -0.0125, 0.1635, 0.0135, 0.0125};
Physical Surface("BIG") = {big()};
Physical Surface("SMALL") = {small()};
Mesh.ElementOrder = 2;
Mesh.CharacteristicLengthMin = 0.0078;
Mesh.CharacteristicLengthMax = 0.0078;
Mesh.Optimize = 1;
