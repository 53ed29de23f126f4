// Uses a library that uses dynmesh.
extern "C" double height_of_last(double height);

int main() {
  const double height = height_of_last(5);
  return height > 4.999 && height < 5.001 ? 0 : 1;
}
