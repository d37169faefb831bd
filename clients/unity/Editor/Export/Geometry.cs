// SPDX-License-Identifier: MIT
// Points, rigid poses and affine maps in the right-handed coordinates of ClothStream, in double precision.
using System;

namespace ClothStream.Export
{
    public struct Point
    {
        public readonly double X, Y, Z;

        public Point(double x, double y, double z)
        {
            X = x;
            Y = y;
            Z = z;
        }

        /// <summary>Point of Unity. Unity is left-handed, so z changes its sign.</summary>
        public static Point OfUnity(double x, double y, double z) { return new Point(x, y, -z); }

        public double Length { get { return Math.Sqrt(X * X + Y * Y + Z * Z); } }
        public static Point operator +(Point a, Point b) { return new Point(a.X + b.X, a.Y + b.Y, a.Z + b.Z); }
        public static Point operator -(Point a, Point b) { return new Point(a.X - b.X, a.Y - b.Y, a.Z - b.Z); }
        public static Point operator *(Point a, double b) { return new Point(a.X * b, a.Y * b, a.Z * b); }

        public static Point Cross(Point a, Point b)
        {
            return new Point(a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X);
        }
    }

    /// <summary>Rotation, as a unit quaternion, and then a translation.</summary>
    public struct RigidPose
    {
        public readonly Point Position;
        public readonly double X, Y, Z, W;

        public RigidPose(Point position, double x, double y, double z, double w)
        {
            double length = Math.Sqrt(x * x + y * y + z * z + w * w);
            Position = position;
            X = x / length;
            Y = y / length;
            Z = z / length;
            W = w / length;
        }

        public static RigidPose Identity { get { return new RigidPose(new Point(), 0, 0, 0, 1); } }

        /// <summary>Pose whose +Y axis points along a direction of any length above 0.</summary>
        public static RigidPose AlongY(Point position, Point direction)
        {
            Point unit = direction * (1 / direction.Length);
            // The half-way quaternion of the rotation from +Y. Opposite to +Y, any axis across it turns by 180 degrees.
            if (unit.Y < -1 + 1e-12) return new RigidPose(position, 1, 0, 0, 0);
            return new RigidPose(position, unit.Z, 0, -unit.X, 1 + unit.Y);
        }

        public RigidPose Inverse
        {
            get
            {
                var turnedBack = new RigidPose(new Point(), -X, -Y, -Z, W);
                return new RigidPose(turnedBack.Apply(Position) * -1, -X, -Y, -Z, W);
            }
        }

        public Point Apply(Point point)
        {
            var axis = new Point(X, Y, Z);
            Point twice = Point.Cross(axis, point) * 2;
            return Position + point + twice * W + Point.Cross(axis, twice);
        }

        /// <summary>The map b, and then a.</summary>
        public static RigidPose operator *(RigidPose a, RigidPose b)
        {
            return new RigidPose(a.Apply(b.Position), a.W * b.X + a.X * b.W + a.Y * b.Z - a.Z * b.Y,
                                 a.W * b.Y + a.Y * b.W + a.Z * b.X - a.X * b.Z, a.W * b.Z + a.Z * b.W + a.X * b.Y - a.Y * b.X,
                                 a.W * b.W - a.X * b.X - a.Y * b.Y - a.Z * b.Z);
        }
    }

    /// <summary>Affine map of points: three rows of four numbers.</summary>
    public sealed class Affine
    {
        readonly double[] rows;

        Affine(double[] rows) { this.rows = rows; }

        /// <summary>Map of Unity as the first three rows of its matrix. Both sides are mirrored, because Unity is left-handed.</summary>
        public static Affine OfUnity(float[] matrix)
        {
            var rows = new double[12];
            for (int i = 0; i < 12; ++i) rows[i] = (i / 4 == 2) != (i % 4 == 2) ? -matrix[i] : matrix[i];
            return new Affine(rows);
        }

        public static Affine operator *(Affine a, Affine b)
        {
            var rows = new double[12];
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 4; ++column)
                {
                    double sum = column == 3 ? a.rows[4 * row + 3] : 0;
                    for (int i = 0; i < 3; ++i) sum += a.rows[4 * row + i] * b.rows[4 * i + column];
                    rows[4 * row + column] = sum;
                }
            return new Affine(rows);
        }

        public Point Apply(Point p)
        {
            return new Point(rows[0] * p.X + rows[1] * p.Y + rows[2] * p.Z + rows[3], rows[4] * p.X + rows[5] * p.Y + rows[6] * p.Z + rows[7],
                             rows[8] * p.X + rows[9] * p.Y + rows[10] * p.Z + rows[11]);
        }

        Point Column(int column) { return new Point(rows[column], rows[4 + column], rows[8 + column]); }

        public double Determinant
        {
            get
            {
                Point across = Point.Cross(Column(0), Column(1)), last = Column(2);
                return across.X * last.X + across.Y * last.Y + across.Z * last.Z;
            }
        }

        /// <summary>Inverse. The determinant must not be 0.</summary>
        public Affine Inverse
        {
            get
            {
                double factor = 1 / Determinant;
                Point a = Column(0), b = Column(1), c = Column(2);
                Point[] lines = { Point.Cross(b, c) * factor, Point.Cross(c, a) * factor, Point.Cross(a, b) * factor };
                Point moved = Column(3);
                var rows = new double[12];
                for (int row = 0; row < 3; ++row)
                {
                    rows[4 * row] = lines[row].X;
                    rows[4 * row + 1] = lines[row].Y;
                    rows[4 * row + 2] = lines[row].Z;
                    rows[4 * row + 3] = -(lines[row].X * moved.X + lines[row].Y * moved.Y + lines[row].Z * moved.Z);
                }
                return new Affine(rows);
            }
        }

        /// <summary>Scale along each axis.</summary>
        public Point Scale { get { return new Point(Column(0).Length, Column(1).Length, Column(2).Length); } }

        /// <summary>Mean scale; 0 if the map is no rotation with one scale: mirrored, sheared, or scaled differently along its
        /// axes by more than 1 %.</summary>
        public double UniformScale
        {
            get
            {
                const double Tolerance = 0.01;
                Point scale = Scale;
                double mean = (scale.X + scale.Y + scale.Z) / 3;
                // For axes at right angles the determinant is the product of the scales; it is less if they are sheared.
                double volume = Determinant / (mean * mean * mean);
                bool isEven = Math.Abs(scale.X - mean) <= Tolerance * mean && Math.Abs(scale.Y - mean) <= Tolerance * mean && Math.Abs(scale.Z - mean) <= Tolerance * mean;
                return mean > 0 && isEven && Math.Abs(volume - 1) <= 3 * Tolerance ? mean : 0;
            }
        }

        /// <summary>Rotation and translation of a map with a uniform scale (Shepperd, "Quaternion from rotation matrix",
        /// Journal of Guidance and Control 1(3), 1978).</summary>
        public RigidPose Rigid
        {
            get
            {
                Point a = Column(0) * (1 / Column(0).Length), b = Column(1) * (1 / Column(1).Length), c = Column(2) * (1 / Column(2).Length);
                double trace = a.X + b.Y + c.Z;
                if (trace >= a.X && trace >= b.Y && trace >= c.Z) return new RigidPose(Column(3), b.Z - c.Y, c.X - a.Z, a.Y - b.X, 1 + trace);
                if (a.X >= b.Y && a.X >= c.Z) return new RigidPose(Column(3), 1 + 2 * a.X - trace, a.Y + b.X, a.Z + c.X, b.Z - c.Y);
                if (b.Y >= c.Z) return new RigidPose(Column(3), a.Y + b.X, 1 + 2 * b.Y - trace, b.Z + c.Y, c.X - a.Z);
                return new RigidPose(Column(3), a.Z + c.X, b.Z + c.Y, 1 + 2 * c.Z - trace, a.Y - b.X);
            }
        }
    }
}
