// A hub of 60 x 60 x 10 mm with four spokes of 60 x 12 x 10 mm. Lengths in mm.
SetFactory("OpenCASCADE");
Box(1) = {-30, -30, -5, 60, 60, 10};
Box(2) = {30, -6, -5, 60, 12, 10};
Box(3) = {-6, 30, -5, 12, 60, 10};
Box(4) = {-90, -6, -5, 60, 12, 10};
Box(5) = {-6, -90, -5, 12, 60, 10};
