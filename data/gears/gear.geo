// A spur gear: involute flanks with parabolic tip relief, radial below the base circle, fillets. Lengths in mm.
// Tooth 0 points along x; tooth i is turned by 360 i/z degrees about z.
SetFactory("OpenCASCADE");
z = 24; m = 5; alpha = 20*Pi/180; width = 3; hub = 30;
r = m*z/2; rb = r*Cos(alpha); ra = r + m; rf = r - 1.25*m; fillet = 0.3*m;
relief = 0.06; r0 = ra - 1.0;                       // depth at the tip, and where it begins
inv = Tan(alpha) - alpha; half = Pi/(2*z) + inv;    // half the angle of a tooth at its base
n = 9;                                              // points of an involute
bend = Asin(fillet/(rf + fillet));
lines[] = {};
For i In {0:z-1}
  For side In {-1:1:2}                              // -1: the flank that faces smaller angles
    c = newp; t = 2*Pi*i/z + side*(half + bend);
    Point(c) = {(rf + fillet)*Cos(t), (rf + fillet)*Sin(t), 0};
    Point(c + 1) = {rf*Cos(t), rf*Sin(t), 0};
    t = 2*Pi*i/z + side*half; q = (rf + fillet)*Cos(bend);
    Point(c + 2) = {q*Cos(t), q*Sin(t), 0};
    For k In {0:n-1}
      q = rb + (ra - rb)*(k/(n - 1))^1.5;
      a = Acos(rb/q);
      off = 0;
      If (q > r0)
        off = relief*((q - r0)/(ra - r0))^2;
      EndIf
      t = 2*Pi*i/z + side*(half - Tan(a) + a - off/q);
      Point(c + 3 + k) = {q*Cos(t), q*Sin(t), 0};
    EndFor
    first~{i}~{side + 1} = c;
  EndFor
EndFor
origin = newp; Point(origin) = {0, 0, 0};
For i In {0:z-1}
  c = first~{i}~{0}; d = first~{i}~{2}; next = first~{(i + 1) % z}~{0};
  l = newl;
  Circle(l) = {c + 1, c, c + 2};
  Line(l + 1) = {c + 2, c + 3};
  Spline(l + 2) = {c + 3:c + 2 + n};
  Line(l + 3) = {c + 2 + n, d + 2 + n};
  Spline(l + 4) = {d + 3:d + 2 + n};
  Line(l + 5) = {d + 3, d + 2};
  Circle(l + 6) = {d + 2, d, d + 1};
  Circle(l + 7) = {d + 1, origin, next + 1};
  lines[] += {l, l + 1, l + 2, l + 3, -(l + 4), l + 5, l + 6, l + 7};
EndFor
bore = newl; Circle(bore) = {0, 0, 0, hub, 0, 2*Pi};
Curve Loop(1) = lines[]; Curve Loop(2) = {bore};
Plane Surface(1) = {1, 2};
Extrude {0, 0, width} { Surface{1}; }
