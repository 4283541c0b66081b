"""Import it after numpy: the matrices of the tests are small, and threads of the BLAS that numpy calls only wait for each other. On two
cores with other work a system of 65 equations took 60 ms with two threads, 0.05 ms with one."""
from threadpoolctl import threadpool_limits

threadpool_limits(1)
