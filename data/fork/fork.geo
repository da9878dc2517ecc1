// A fork: two tines 60 x 10 x 6 mm, 0.2 mm apart, on a web. Lengths in m.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 0.06, 0.01, 0.006};
Box(2) = {0, 0, 0.0062, 0.06, 0.01, 0.006};
Box(3) = {-0.006, 0, 0, 0.006, 0.01, 0.0122};
BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2,3}; Delete; };
