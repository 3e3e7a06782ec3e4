#ifndef YOULA_@P@_H
#define YOULA_@P@_H

#ifndef YOULA_REAL
#define YOULA_REAL double
#endif

typedef YOULA_REAL @p@_real;
