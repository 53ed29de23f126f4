[StructLayout(LayoutKind.Sequential)]
struct Points { public IntPtr Data; public long Count, RowStride, ColumnStride; public int Type; }

[StructLayout(LayoutKind.Sequential)]
struct FrameReport
{
    public long Known, Filled, Disconnected, Rejected, Iterations;
    public double Seconds, Blend, PriorWeight, PriorShare, FirstOrderShare, StandardError;
}

static class Dynmesh
{
    [DllImport("dynmesh")] public static extern IntPtr dynmesh_last_message();
    [DllImport("dynmesh")] public static extern int dynmesh_create(
        int[] faces, long nFaces, in Points firstFrame, IntPtr settings, out IntPtr completer);
    [DllImport("dynmesh")] public static extern int dynmesh_push(
        IntPtr completer, in Points points, IntPtr known, in Points output, out FrameReport report);
    [DllImport("dynmesh")] public static extern void dynmesh_destroy(IntPtr completer);
}
