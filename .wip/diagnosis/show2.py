import json,sys
sys.path.insert(0,'/tmp')
B=json.load(open(sys.argv[1])); S=B['sets']
import math
def lp(t):
    T=.05; out=[-1e9,-1e9]
    for a,k,w,ld in t['cells']:
        ab=lambda x,m,s: -0.5*(math.log(x/m)/s)**2-math.log(s)
        am=lambda x,m,s: ab(max(x,m),m,s)
        b=T*ld+am(a,1.1,.69)+ab(w/math.sqrt(T),1,.22)-5.5*len(t['effects'])
        out[0]=max(out[0],b+am(k,.1,.5)); out[1]=max(out[1],b+ab(k,.4,.5)-1.7)
    if t['at_bound'] or t['is_beyond_stated']: out[0]=-1e9
    return out
for t in sorted(S,key=lambda t:-max(lp(t)))[:5]+[t for t in S if not t['effects']]:
    b=max(t['cells'],key=lambda c:c[3]); print('%.1f %.1f'%tuple(lp(t)),'lnp %.0f'%b[3],t['effects'],'cell',b[:3],'wst %.2f sh %.2g'%(t['worst'],t['shrink']),'BEYOND' if t['is_beyond_stated'] else '', 'bound' if t['at_bound'] else '')
print(B['answer']['none_of_mine'],B['answer']['gap']['force_rms_N'],B['answer']['verdict'],B['answer']['remarks'][:6])
